"""Zones in actuator space: an actuator beyond a value. Closed form, exact.

"Touching" means at or beyond the limit; clearances are in the actuator's unit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rampe_guard.core.types import Certificate, ZoneSweep

if TYPE_CHECKING:
    from rampe_guard.core.scene import ActuatorLimit
    from rampe_guard.core.types import FloatArray


def sweep_limit(zone: ActuatorLimit, start: FloatArray, displacement: FloatArray) -> ZoneSweep:
    """Sweep one actuator limit along the whole path."""
    q, x = float(start[zone.actuator]), float(displacement[zone.actuator])
    up = math.inf if zone.above is None else zone.above - q
    down = math.inf if zone.below is None else q - zone.below
    now, end = min(up, down), min(up - x, down + x)
    # the clearance is concave in q (the least of two lines), so its least is at an end
    fraction = None
    if now <= 0.0:
        fraction = 0.0
    elif up <= x:
        fraction = up / x
    elif down <= -x:
        fraction = down / -x
    elif end <= 0.0:
        fraction = 1.0  # a rounding error hid the crossing
    return ZoneSweep(
        zone=zone.name,
        certificate=Certificate.FREE if fraction is None else Certificate.CONTACT,
        contact_fraction=fraction,
        link=None,
        contact_point_m=None,
        clearance_m=max(min(now, end), 0.0),
        clearance_now_m=now,
        # whether the nearer edge comes nearer
        closing=x > 0.0 if up < down else x < 0.0 if down < up else x != 0.0,
    )


def limit_clearance(zone: ActuatorLimit, value: float) -> float:
    """How far an actuator value is from the zone; negative inside."""
    rooms = []
    if zone.above is not None:
        rooms.append(zone.above - value)
    if zone.below is not None:
        rooms.append(value - zone.below)
    return min(rooms, default=float("inf"))
