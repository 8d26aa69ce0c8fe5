"""The sound of what asks for attention now: played until somebody has seen it.

It follows the state of the machines, not their news, so that it can neither miss an end nor
go on after one. What sounds is an alert that nobody has acknowledged or shelved, and lost
protection: NOT MONITORING until it is acknowledged at the guard, an unavailable guard until it
is back.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TextIO

from rampe_guard.client import MachineState, Protection
from rampe_guard.core.alarm import Level
from rampe_guard.notify.child import Runner, Template
from rampe_guard.notify.target import NotHeardError
from rampe_guard.notify.tones import IMMINENT, TONES, UNPROTECTED, WARNING, Tone, write

BELL = "bell"
"""Instead of a command: the bell of the terminal."""
_BEEP_S = 0.25
_FAILED_S = 2.0
_OVERTIME_S = 3.0
"""How much longer than its tone a player may run [s]."""


def sounding(machines: Iterable[MachineState], at_least: Level) -> Tone | None:
    """The gravest tone that should sound now; None for silence."""
    found = [tone for machine in machines if (tone := _tone(machine, at_least)) is not None]
    return max(found, key=lambda tone: tone.grave, default=None)


def _tone(machine: MachineState, at_least: Level) -> Tone | None:
    calls = [a for a in machine.active if a.state == "unacked" and not machine.expired(a)]
    levels = [a.urgency for a in calls if a.urgency >= at_least and a.source != "system"]
    if Level.IMMINENT in levels:
        return IMMINENT
    if Level.WARNING in levels:
        return WARNING
    if machine.protection is Protection.UNAVAILABLE:
        return UNPROTECTED
    if machine.protection is Protection.NOT_MONITORING:
        system = [a for a in machine.alerts if a.source == "system"]
        quiet = any(a.state == "acked" or a.shelved for a in system)
        return None if quiet else UNPROTECTED
    return None


class Sound:
    """Plays what `follow` was last given, in a thread of its own.

    Args:
        player: a command that plays a WAV file, whose path takes the place of ``{wav}`` or
            comes last; or `BELL`.
        say: tells people that it does not sound.
        terminal: where a bell is written.

    Raises:
        SettingsError: the player cannot be run.
    """

    def __init__(self, player: str, say: Callable[[str, str], None], terminal: TextIO) -> None:
        self._say, self._terminal = say, terminal
        self._player = None if player == BELL else Template(_with_wav(player), ("wav",))
        self._runner = Runner()
        self._folder = tempfile.TemporaryDirectory(prefix="rampe-guard-tones-")
        self._paths = {tone: write(tone, Path(self._folder.name)) for tone in TONES}
        self._news = threading.Condition()
        self._tone: Tone | None = None
        self._stopped = False
        self._thread = threading.Thread(target=self._work, name="sound", daemon=True)
        self._thread.start()

    def follow(self, tone: Tone | None) -> None:
        """Let this sound from now on; None for silence. Never waits."""
        with self._news:
            if tone is self._tone:
                return
            self._tone = tone
            self._news.notify()
            self._runner.interrupt()  # neither a lesser tone nor one that is over is played out

    def stop(self, within_s: float = 1.0) -> None:
        """End."""
        with self._news:
            self._stopped = True
            self._news.notify()
        self._runner.stop()
        self._thread.join(within_s)
        self._folder.cleanup()

    def _work(self) -> None:
        while (tone := self._awaited()) is not None:
            began_s = time.monotonic()
            wait_s = tone.period_s
            try:
                self._play(tone)
            except NotHeardError as error:
                if self._now() is tone:  # else it was broken off by us
                    self._say("sound failed", f"no sound: {error}")
                    wait_s = _FAILED_S
            except Exception as error:  # noqa: BLE001 - a terminal that is gone: it may come back
                self._say("sound failed", f"no sound: {error!r}")
                wait_s = _FAILED_S
            self._rest(tone, began_s + wait_s)

    def _play(self, tone: Tone) -> None:
        if self._player is not None:
            words = self._player.fill({"wav": str(self._paths[tone])})
            self._runner.run(words, tone.period_s + _OVERTIME_S)
            return
        for _ in tone.beeps:
            self._terminal.write("\a")
            self._terminal.flush()
            self._rest(tone, time.monotonic() + _BEEP_S)

    def _now(self) -> Tone | None:
        with self._news:
            return None if self._stopped else self._tone

    def _awaited(self) -> Tone | None:
        with self._news:
            self._news.wait_for(lambda: self._tone is not None or self._stopped)
            return None if self._stopped else self._tone

    def _rest(self, tone: Tone, until_s: float) -> None:
        """Wait, but no longer than this tone should sound."""
        with self._news:
            left_s = until_s - time.monotonic()
            self._news.wait_for(lambda: self._tone is not tone or self._stopped, max(0.0, left_s))


def _with_wav(player: str) -> str:
    return player if "{wav}" in player else f"{player} {{wav}}"
