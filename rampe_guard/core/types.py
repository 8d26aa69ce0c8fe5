"""Samples, categories and sweep results: what travels through the core.

Shapes: ``n`` actuators, ``m`` joystick axes. Actuator units are the site's ([rad] or [m]).
Times named ``stamp_s`` are on the clock of the sender, times named ``now_s`` or
``arrival_s`` on the clock of whoever calls the core; only differences are ever used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]
Category: TypeAlias = tuple[int, ...]
"""Ω: one sign in {-1, 0, +1} per actuator."""
Point: TypeAlias = tuple[float, float, float]
InputName: TypeAlias = Literal["joystick", "actuators", "enabled"]


@dataclass(frozen=True, slots=True)
class JoystickSample:
    """One joystick message: ``axes`` (m,) in [-1, 1].

    Not ``stamped``: the message had no stamp, and ``stamp_s`` is its arrival.
    """

    stamp_s: float
    axes: FloatArray
    arrival_s: float
    stamped: bool = True


@dataclass(frozen=True, slots=True)
class ActuatorSample:
    """One actuator message: ``position`` (n,) and, where measured, ``velocity`` (n,).

    Not ``stamped``: the message had no stamp, and ``stamp_s`` is its arrival.
    """

    stamp_s: float
    position: FloatArray
    velocity: FloatArray | None
    arrival_s: float
    stamped: bool = True


@dataclass(frozen=True, slots=True)
class EnabledSample:
    """One message of the enable key: whether the machine says that it is switched on.

    Not ``stamped``: the message had no stamp, and ``stamp_s`` is its arrival.
    """

    enabled: bool
    stamp_s: float
    arrival_s: float
    stamped: bool = True


@dataclass(frozen=True, slots=True)
class ObjectSample:
    """One pose message of the keyed object ``name``: its own frame in the world (4, 4) [m].

    Not ``stamped``: the message had no stamp, and ``stamp_s`` is its arrival.
    """

    name: str
    pose: FloatArray
    stamp_s: float
    arrival_s: float
    stamped: bool = True


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a keyed object stands now: its frame in the world (4, 4) [m].

    ``grown_m`` is how far any of its points may have gone since it was seen there [m]: every
    point of the world that is nearer than this to the placed shape may be inside the object.
    """

    pose: FloatArray
    grown_m: float


@dataclass(frozen=True, slots=True)
class Inputs:
    """All that arrived since the last step, each list in order of arrival.

    ``rejected`` lists messages that never became a sample, as (input name, reason), and
    ``objects_rejected`` the same of keyed objects, as (object name, reason).
    ``joystick_alive`` is what the joystick's liveliness token says, None without a token.
    ``canary`` says what this machine computed wrongly when it was tried, and ``restarted`` after
    what the guard was started anew; both are None where there is nothing to say.
    ``enabled`` is what came on the enable key.
    """

    joystick: tuple[JoystickSample, ...] = ()
    actuators: tuple[ActuatorSample, ...] = ()
    rejected: tuple[tuple[InputName, str], ...] = ()
    joystick_alive: bool | None = None
    objects: tuple[ObjectSample, ...] = ()
    objects_rejected: tuple[tuple[str, str], ...] = ()
    canary: str | None = None
    restarted: str | None = None
    enabled: tuple[EnabledSample, ...] = ()


class Certificate(StrEnum):
    """What a sweep proved. ``UNKNOWN`` is never free: the alarm logic treats it as contact."""

    FREE = "free"
    CONTACT = "contact"
    UNKNOWN = "unknown"


class AnyPath(StrEnum):
    """Whether any monotone way from start to end could touch."""

    FREE = "free"
    POSSIBLE = "possible"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class ZoneSweep:
    """What one sweep proved about one zone (a keep-out object or an actuator limit).

    Attributes:
        zone: its name.
        certificate: free, contact or unknown.
        contact_fraction: first s in [0, 1] that could not be certified free; None when free.
        link: the link that touches, or comes nearest.
        contact_point_m: world point [m] of the first contact; None for actuator limits.
        clearance_m: lower bound [m] of the distance along the whole path less the zone's
            margin, 0 in contact, None when unknown (for actuator limits: actuator units).
        clearance_now_m: the same at the start of the path; negative inside the margin.
        closing: the clearance shrinks at the start of the path.
        margin_m: the zone's own margin [m]; None for actuator limits.
        confirmed_fraction: where, at most the tolerance of motion later, the contact was seen
            to be one; None without contact or if it could be refuted no further.
        confirmed: whether the exact shapes touch there, by another library; None where that is
            not asked: it needs a contact with the object itself (no margin, no growth), later
            than the start. A contact that is not confirmed is a contact all the same.
    """

    zone: str
    certificate: Certificate
    contact_fraction: float | None
    link: str | None
    contact_point_m: Point | None
    clearance_m: float | None
    clearance_now_m: float | None
    closing: bool
    margin_m: float | None = None
    confirmed_fraction: float | None = None
    confirmed: bool | None = None

    @property
    def inside(self) -> bool:
        """The arm is within the keep-out distance at the start of the path."""
        return self.clearance_now_m is not None and self.clearance_now_m <= 0.0

    @property
    def touching(self) -> bool:
        """The arm touches the solid object itself at the start of the path."""
        if self.margin_m is None or self.clearance_now_m is None:
            return False
        return self.clearance_now_m <= -self.margin_m

    @property
    def past_limit(self) -> bool:
        """The zone is an actuator limit, and the actuator is beyond it."""
        return self.margin_m is None and (self.clearance_now_m or 0.0) < 0.0


@dataclass(frozen=True, slots=True)
class SweepResult:
    """A sweep of every link against every zone; the properties give the worst zone.

    Attributes:
        zones: one entry per zone, in scene order.
        any_path: answer for every monotone path, None when it was not asked.
        witness: with ``any_path`` possible, actuator values (n,) between start and end at which
            the arm touches.
        queries: clearance queries spent.
        elapsed_ms: time of the sweep alone [ms], None where no clock was at hand.
    """

    zones: tuple[ZoneSweep, ...]
    any_path: AnyPath | None = None
    witness: tuple[float, ...] | None = None
    queries: int = 0
    elapsed_ms: float | None = None

    @property
    def worst(self) -> ZoneSweep | None:
        """The zone touched first; else an unknown one; else the nearest; None without zones."""
        touched = [z for z in self.zones if z.contact_fraction is not None]
        if touched:
            return min(touched, key=lambda z: z.contact_fraction or 0.0)
        unknown = [z for z in self.zones if z.certificate is not Certificate.FREE]
        if unknown:
            return unknown[0]
        return min(self.zones, key=lambda z: _or_inf(z.clearance_m), default=None)

    @property
    def certificate(self) -> Certificate:
        """Contact if any zone is touched, else unknown if any is, else free."""
        kinds = {z.certificate for z in self.zones}
        for kind in (Certificate.CONTACT, Certificate.UNKNOWN):
            if kind in kinds:
                return kind
        return Certificate.FREE

    @property
    def contact_fraction(self) -> float | None:
        """First fraction of the path that is not certified free [-]."""
        return self.worst.contact_fraction if self.worst else None

    @property
    def zone(self) -> str | None:
        """Name of the worst zone."""
        return self.worst.zone if self.worst else None

    @property
    def link(self) -> str | None:
        """Link nearest to the worst zone."""
        return self.worst.link if self.worst else None

    @property
    def contact_point_m(self) -> Point | None:
        """World point of the first contact [m]."""
        return self.worst.contact_point_m if self.worst else None

    @property
    def clearance_m(self) -> float | None:
        """Smallest proven clearance over all zones less their margins [m]."""
        values = [z.clearance_m for z in self.zones]
        known = [v for v in values if v is not None]
        return min(known) if known and len(known) == len(values) else None


def _or_inf(value: float | None) -> float:
    return float("inf") if value is None else value


class PathSweeper(Protocol):
    """What the guard needs of geometry: a certified sweep of a straight actuator path."""

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        """Sweep from ``start`` (n,) along ``displacement`` (n,), both in actuator units.

        Without ``clearance``, clearances are proven but need not be sharp. With ``only``, the
        answer is about the zones of these names and no others. ``placed`` says where the keyed
        objects stand; one that is None or not in it could be anywhere, and is unknown. With
        ``wider_m``, certificates are about margins of solid zones wider by so much [m], while
        clearances still count from the margins themselves.
        """
        ...
