"""Receives, writes, and tells how it goes. Whatever the disk does, it never stops by itself.

One thread looks for messages 500 times a second and does nothing else, so that the time
of an arrival is right however long the disk takes. Another brings what came to the disk twice a
second. A disk that refuses is tried again every second, with a new file, while what comes waits;
when no more can wait it is dropped, counted and told.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from rampe_guard import __version__, wire
from rampe_guard.recording.backlog import Backlog
from rampe_guard.recording.series import Series
from rampe_guard.recording.taps import Taps
from rampe_guard.recording.writer import Entry
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site

_LOOK_S = 0.002
_COMMIT_S = 0.5
_RETRY_S = 1.0
_TELL_S = 1.0
_RECENT_S = 5.0
"""How long a loss keeps the status degraded."""


@dataclass(frozen=True, slots=True)
class Ended:
    """What became of a recording.

    Attributes:
        messages: that are on the disk.
        dropped: that are lost.
        written_bytes: size of all files.
    """

    messages: int
    dropped: int
    written_bytes: int


class Recorder:
    """Records one machine until it is told to stop.

    Args:
        bus: an open session.
        site: whose machine.
        taps: what is heard.
        series: where it is written.
        say: log.
        notice: shown every message that came.
        another: told of every batch before it is written; whether it belongs into another file.
        backlog: what may wait.
    """

    def __init__(
        self,
        bus: Bus,
        site: Site,
        taps: Taps,
        series: Series,
        say: Sayer,
        notice: Callable[[Entry], None] = lambda _: None,
        another: Callable[[], bool] = lambda: False,
        backlog: Backlog | None = None,
    ) -> None:
        self._site, self._taps, self._series = site, taps, series
        self._say, self._notice, self._another = say, notice, another
        self._backlog = Backlog() if backlog is None else backlog
        key = f"{site.keys.base}/recorder"
        self._outbox = bus.outbox(key, "rampe.recorder.v1")
        bus.declare_alive(key)
        self._over = threading.Event()
        self._refused: str | None = None
        self._bug: BaseException | None = None
        self._told: str | None = None
        self._lost, self._lost_s = 0, float("-inf")

    @property
    def dropped(self) -> int:
        """Messages lost so far; one for each time that a subscription was found full."""
        return self._backlog.dropped + self._taps.overruns

    def run(self, stopped: Callable[[], bool], wait: Callable[[float], object]) -> Ended:
        """Record until ``stopped``; ``wait`` sleeps."""
        writer = threading.Thread(target=self._write, name="writer")
        writer.start()
        told_s = float("-inf")
        try:
            while not stopped() and self._bug is None:
                came = self._taps.look()
                self._backlog.put(came)
                for entry in came:
                    self._notice(entry)
                now_s = time.monotonic()
                if now_s - told_s >= _TELL_S:
                    told_s = now_s
                    self._tell(now_s)
                wait(_LOOK_S)
        finally:
            self._over.set()
            writer.join()
        if self._bug is not None:
            raise self._bug
        return Ended(self._series.messages, self.dropped, self._series.written_bytes)

    def _write(self) -> None:
        """The writing thread."""
        try:
            while not self._over.wait(_COMMIT_S if self._refused is None else _RETRY_S):
                self._empty()
            self._empty()
            self._backlog.give_up()
            self._finish()
        except BaseException as error:  # noqa: BLE001 - for the other thread to raise
            self._bug = error

    def _empty(self) -> None:
        """Write all that waits, if the disk lets us."""
        try:
            while batch := self._backlog.first():
                if self._another():
                    self._series.begin_anew({"reason": "another scene"})
                self._series.append(batch)
                self._backlog.written(len(batch))
                self._refused = None
            if self._refused is not None:  # nothing came: is there room again?
                self._series.open()
                self._refused = None
        except OSError as error:
            self._refused = f"{error.filename or 'the disk'}: {error.strerror}"

    def _finish(self) -> None:
        try:
            self._series.finish({"reason": "stopped", "dropped": str(self.dropped)})
        except OSError as error:
            self._say.warn("end", f"the last file has no index, but can be read: {error.strerror}")

    def _tell(self, now_s: float) -> None:
        dropped = self.dropped
        if dropped > self._lost:
            self._lost, self._lost_s = dropped, now_s
        reasons = [] if self._refused is None else [f"nothing can be written: {self._refused}"]
        if now_s - self._lost_s <= _RECENT_S:
            reasons.append(f"{dropped} messages lost so far")
        reason = "; ".join(reasons) or None
        self._log(reason)
        file = self._series.current
        message = wire.Recorder(
            site=self._site.name,
            machine=self._site.machine,
            status="recording" if reason is None else "degraded",
            reason=reason,
            file=None if file is None else file.name,
            files=len(self._series.begun),
            messages=self._series.messages,
            written_bytes=self._series.written_bytes,
            waiting=len(self._backlog),
            dropped=dropped,
            version=__version__,
            published_unix_s=time.time(),
        )
        self._outbox.put(wire.encode(message))

    def _log(self, reason: str | None) -> None:
        if reason == self._told:
            return
        if reason is not None:
            self._say.warn("degraded", f"degraded: {reason}")
        else:
            self._say.info("recording again")
        self._told = reason
