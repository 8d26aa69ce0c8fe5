"""The referee: knows from the true motion alone when the arm was inside a keep-out margin.

It sweeps between successive samples with the same certificates as the guard, so nothing
slips through between two samples, and it knows nothing of forecasts or alerts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.core.types import Certificate, FloatArray, PathSweeper, ZoneSweep
from rampe_guard.evaluate.episodes import Contact

LEAVE_M = 0.005
LEAVE_LIMIT = 0.001
"""An arm is out of a zone again when it is clear by this much: [m], or the actuator's unit for
an actuator limit, where a millimetre of stroke or a milliradian is more than a count of the
encoder.

An arm that rests at an edge crosses it with every tremble of its encoders; that is no entry.
"""


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """The arm entered or left the margin of ``contact.zone`` at ``time_s`` [s]."""

    time_s: float
    entered: bool
    contact: Contact


class Referee:
    """Follows the arm and keeps every contact; `feed` it samples in order of time.

    An entry is timed by the contact fraction of the sweep that found it. Leaving is known
    at the first sample outside by `LEAVE_M`. A sweep without an answer counts as contact, from
    the first fraction that it could not certify, and is marked ``unknown``.
    """

    def __init__(self, sweeper: PathSweeper, zones: Iterable[str] | None = None) -> None:
        """Follow all zones of ``sweeper``, or only those of these names."""
        self._sweeper = sweeper
        self._only = None if zones is None else frozenset(zones)
        self._last: tuple[float, FloatArray] | None = None
        self._open: dict[str, Contact] = {}
        self._closed: list[Contact] = []

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts so far, in order of entry; those still on have no ``left_s``."""
        return tuple(sorted((*self._closed, *self._open.values()), key=lambda c: c.entered_s))

    @property
    def inside(self) -> frozenset[str]:
        """Zones whose margin the arm is in now."""
        return frozenset(self._open)

    def feed(
        self, time_s: float, position: FloatArray, asked: frozenset[str] | None = None
    ) -> tuple[ContactEvent, ...]:
        """Take the next sample and return what it brought to light.

        Args:
            time_s: of the sample [s], later than the one before.
            position: (n,) [unit].
            asked: the zones that are not known otherwise to be free, by more than what leaving
                takes, from the sample before to this one; None for all.

        Raises:
            ValueError: time does not advance, or a value is not finite.
        """
        position = np.asarray(position, dtype=np.float64)
        if not (np.isfinite(time_s) and np.all(np.isfinite(position))):
            raise ValueError(f"a referee needs finite samples, not {position} at {time_s} s")
        if self._last is not None and time_s <= self._last[0]:
            raise ValueError(f"sample at {time_s} s does not follow the one at {self._last[0]} s")
        # The first sample is a sweep of no length: is the arm inside something already?
        from_s, start = (time_s, position) if self._last is None else self._last
        self._last = (time_s, position)
        only = self._only if asked is None else asked | self._open.keys()
        if only is not None and not only:
            return ()
        result = self._sweeper.sweep(start, position - start, clearance=False, only=only)
        events: list[ContactEvent] = []
        for zone in result.zones:
            events.extend(self._judge(self._start_known(zone, start), from_s, time_s))
        return tuple(events)

    def _start_known(self, zone: ZoneSweep, start: FloatArray) -> ZoneSweep:
        """The same, with the clearance at the start sharp where a contact waits for its end."""
        free = zone.certificate is Certificate.FREE
        if zone.zone not in self._open or not (free or (zone.contact_fraction or 0.0) > 0.0):
            return zone
        still = self._sweeper.sweep(start, np.zeros_like(start), only=frozenset([zone.zone]))
        return replace(zone, clearance_now_m=still.zones[0].clearance_now_m)

    def _judge(self, zone: ZoneSweep, from_s: float, to_s: float) -> list[ContactEvent]:
        events: list[ContactEvent] = []
        free = zone.certificate is Certificate.FREE
        fraction = 0.0 if zone.contact_fraction is None else zone.contact_fraction
        on = self._open.get(zone.zone)
        leave = LEAVE_LIMIT if zone.margin_m is None else LEAVE_M
        out = (free or fraction > 0.0) and (zone.clearance_now_m or 0.0) > leave
        if on is not None and out:
            closed = replace(on, left_s=from_s)
            self._closed.append(closed)
            del self._open[zone.zone]
            events.append(ContactEvent(from_s, entered=False, contact=closed))
            on = None
        if free:
            return events
        unknown = zone.certificate is Certificate.UNKNOWN
        if on is None:
            on = Contact(zone.zone, from_s + fraction * (to_s - from_s), unknown=unknown)
            events.append(ContactEvent(on.entered_s, entered=True, contact=on))
        self._open[zone.zone] = replace(on, unknown=on.unknown or unknown)
        return events
