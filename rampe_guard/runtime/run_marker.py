"""Did the last run end cleanly, and what had nobody seen by then?

A small file beside the models of a machine stands there for as long as its guard runs. A guard
that finds one left behind knows that the run before was cut off (a kill, memory gone, power
lost), even where no supervisor lived to tell. In it are also the alerts that wait for an
acknowledgement and do not go by themselves: contacts, and "not monitoring". What nobody has seen
is told after a restart, however the guard ended, until somebody acknowledges that.
"""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import msgspec

from rampe_guard import wire
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_folder
from rampe_guard.runtime.store_saver import Save, Saver
from rampe_guard.settings import Site

NAME: Final = "guard.run.json"
"""No operator's model has such a name: theirs end in .npz."""
_MOST_BYTES: Final = 1 << 16
_MOST: Final = 20
"""Alerts that are remembered; the newest ones."""
_END_S: Final = 0.3
_BLIND: Final = "not monitoring"
_TOLD: Final = "canary failed"
"""That is told by the supervisor anyway."""
_UNSEEN: Final = ("unacked", "rtn_unacked")
_COMPUTER: Final = Path("/proc/sys/kernel/random/boot_id")


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """What is in the file.

    Attributes:
        clean: the run has ended as it should.
        started_unix_s: when it began [s].
        computer: changes whenever the computer starts anew; empty if unknown.
        unseen: what waits for an acknowledgement, in words.
    """

    clean: bool
    started_unix_s: float
    computer: str = ""
    unseen: tuple[str, ...] = ()


class RunMarker:
    """The file of one machine's guard, for as long as it runs; a context manager.

    Nothing here ever stops a guard: what cannot be kept is said.

    Args:
        site: of the machine.
        say: log.

    Attributes:
        clean: set it when the run has ended as it should.
        cause: of what the run before ended, if not as it should; for people.
        unseen: what nobody has seen of what the runs before raised, in words.
    """

    def __init__(self, site: Site, say: Sayer) -> None:
        self._site, self._say = site, say
        self._file: ModelFile | None = None
        self._saver: Saver[Run] | None = None
        self._stuck: str | None = None
        self._now = Run(clean=False, started_unix_s=time.time(), computer=_computer())
        self._new: dict[str, str] = {}
        self.clean = False
        self.cause: str | None = None
        self.unseen: tuple[str, ...] = ()

    def after(self, told: str | None) -> str | None:
        """After what the guard was started anew, for its alert; None if there is nothing to say.

        Args:
            told: what the supervisor says of it; it knows best.
        """
        cause = told or self.cause
        if not self.unseen:
            return cause
        return f"{cause or 'a stop'}; unseen: {', '.join(self.unseen)}"

    def note(self, alert: wire.Alert) -> None:
        """An alert has changed; never waits."""
        before = self._unseen()
        waits = alert.state in _UNSEEN
        if alert.source == "system" and not waits:
            self.unseen = ()  # somebody has seen what was told of the runs before
        if not waits:
            self._new.pop(alert.alert_id, None)
        elif alert.source == "contact":
            self._new[alert.alert_id] = f"{alert.link or 'arm'} at {alert.zone}"
        elif alert.source == "system" and alert.level == "warning" and _TOLD not in alert.text:
            self._new[alert.alert_id] = _BLIND
        if self._unseen() != before:
            self._save()

    def reasons(self) -> tuple[wire.Reason, ...]:
        """Why alerts would not outlive a crash, for the heartbeat."""
        problem = self._stuck or (self._saver and self._saver.problem)
        if not problem:
            return ()
        text = f"alerts that nobody has seen would be lost in a crash: {problem}"
        return (wire.Reason(code="alerts_not_kept", text=text, key=None),)

    def _unseen(self) -> tuple[str, ...]:
        words = dict.fromkeys((*self.unseen, *self._new.values()))
        # contacts first: a display has room for one of them
        return tuple(sorted(list(words)[-_MOST:], key=_BLIND.__eq__))

    def _save(self) -> None:
        if self._saver is not None:
            run = msgspec.structs.replace(self._now, clean=self.clean, unseen=self._unseen())
            self._saver.give(Save(partial(msgspec.json.encode, run), run))

    def __enter__(self) -> Self:
        try:
            self._file = ModelFile(model_folder(self._site) / NAME, _MOST_BYTES)
            self._file.lock()
        except ModelFileError as error:
            self._stuck = str(error)
            self._say.warn("run", f"alerts that nobody has seen are not kept: {error}")
            return self
        self._recall(self._file)
        self._saver = Saver(self._file, self._now)
        self._save()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        file, saver = self._file, self._saver
        if file is None or saver is None:
            return
        if self.clean:
            self._save()
        if not saver.finish(_END_S):
            return  # the file stays locked: it may still be written
        if self.clean and not self._unseen():
            try:
                file.remove()
            except ModelFileError as stuck:
                self._say.warn("run", f"the next guard will take this run for cut off: {stuck}")
        file.release()

    def _recall(self, file: ModelFile) -> None:
        try:
            if (content := file.read()) is None:
                return
            run = msgspec.json.decode(content, type=Run)
        except (ModelFileError, msgspec.DecodeError, UnicodeDecodeError) as error:
            self.cause = "an end of which nothing is known"
            self._say.warn("run", f"{NAME} of the run before cannot be read: {error}")
            return
        self.unseen = run.unseen
        if not run.clean:
            other = bool(run.computer) and run.computer != self._now.computer
            self.cause = "a power loss or reboot" if other else "a kill"
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(run.started_unix_s))
        how = "ended" if run.clean else f"was cut off by {self.cause}"
        seen = f"; nobody has seen: {', '.join(run.unseen)}" if run.unseen else ""
        self._say.warn("run", f"the run that began {when} {how}{seen}", unseen=len(run.unseen))


def _computer() -> str:
    """The id of this start of the computer."""
    try:
        return _COMPUTER.read_text("ascii").strip()
    except (OSError, ValueError):  # not Linux
        return ""
