"""What the guard sees as visualization_msgs/MarkerArrays for RViz.

Every marker goes by itself after `LIFETIME_S`: a guard that is gone leaves no picture of a clear
scene behind. Colour is never alone: an alert's words stand at its zone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from rampe_guard import wire
from rampe_guard.core.types import FloatArray
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.diagnostics import monitors
from rampe_guard.ros2.shapes import SPHERE, Ghost, Solid, quaternion

LIFETIME_S: Final = 2.5
_SHORT_S: Final = 1.2
"""Of what may be gone soon: words, contacts and ghosts are sent twice a second."""
MOST_ZONES: Final = 200
"""Zones with an alert come first; more than these RViz need not draw."""
_TEXT: Final = 9
_PARTS: Final = 3
"""A zone is drawn of at most so many markers (a capsule)."""

Colour = tuple[float, float, float, float]
_LEVELS: Final[Mapping[str, Colour]] = {
    "clear": (0.62, 0.64, 0.66, 0.30),
    "caution": (0.95, 0.80, 0.15, 0.55),
    "warning": (0.98, 0.60, 0.05, 0.65),
    "imminent": (0.90, 0.08, 0.08, 0.80),
}
_UNKNOWN: Final[Colour] = (0.25, 0.25, 0.28, 0.35)
_GHOST: Final[Colour] = (0.20, 0.50, 0.95, 0.35)
_CONTACT: Final[Colour] = (0.90, 0.08, 0.08, 1.0)
_WORDS: Final[Colour] = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Painter:
    """Makes marker arrays of one machine.

    Attributes:
        ghost: its arm.
        actuators: names in the order of positions.
        frame: of the world.
    """

    ghost: Ghost
    actuators: tuple[str, ...]
    frame: str

    def zones(
        self, state: wire.State | None, solids: Mapping[str, Sequence[Solid]], stamp_s: float
    ) -> Any:
        """All zones by their level, points of contact, and the banner if nobody watches."""
        watched = monitors(state)
        alerts = () if state is None else wire.by_urgency(state.alerts)
        levels = {a.zone: a for a in reversed(alerts) if a.zone is not None}
        shown = sorted(solids, key=lambda name: name not in levels)[:MOST_ZONES]
        found = []
        for number, name in enumerate(shown):
            alert = levels.get(name)
            level = "clear" if alert is None else alert.level
            colour = _LEVELS[level] if watched else _UNKNOWN
            for part, solid in enumerate(solids[name]):
                place = "zones", _PARTS * number + part
                found.append(self._solid(place, solid, colour, stamp_s, LIFETIME_S))
        for number, alert in enumerate(a for a in alerts if a.level != "clear"):
            found += self._alert(number, alert, stamp_s)
        if not watched:
            found.append(self._words("banner", 0, self._above(0.0), "NOT MONITORING", stamp_s))
        return cdr.make("visualization_msgs/msg/MarkerArray", markers=found)

    def way(self, state: wire.State, stamp_s: float) -> Any | None:
        """The arm where the operator usually goes from here; None: nothing is under way."""
        ends = self._ends(state)
        if not ends:
            return None
        found = []
        for number, end in enumerate(ends):
            for part, solid in enumerate(self.ghost.at(end)):
                place = f"ghost{number}", part
                found.append(self._solid(place, solid, _GHOST, stamp_s, _SHORT_S))
        return cdr.make("visualization_msgs/msg/MarkerArray", markers=found)

    def _ends(self, state: wire.State) -> list[FloatArray]:
        if not monitors(state) or not state.predictions or state.position is None:
            return []
        told = state.predictions[0]
        if told.event == "ended":
            return []
        ends = [e.position for e in told.endpoints]
        if not ends and told.endpoint is not None:
            ends = [told.endpoint]
        here = state.position
        return [np.array([end.get(n, here[n]) for n in self.actuators]) for end in ends]

    def _alert(self, number: int, alert: wire.Alert, stamp_s: float) -> list[Any]:
        if alert.contact_point_m is None:
            place = self._above(1.0 + number)
            return [self._words("alerts", number, place, alert.text, stamp_s)]
        pose = np.eye(4)
        pose[:3, 3] = alert.contact_point_m
        wide = 0.06 * self.ghost.size_m
        over = pose[:3, 3] + np.array([0.0, 0.0, 0.15 * self.ghost.size_m])
        ball = Solid(SPHERE, pose, (wide, wide, wide))
        return [
            self._solid(("contacts", number), ball, _CONTACT, stamp_s, _SHORT_S),
            self._words("alerts", number, over, alert.text, stamp_s),
        ]

    def _above(self, lines: float) -> FloatArray:
        """Over the arm's foot, so many lines down."""
        place = self.ghost.foot.copy()
        place[2] += (1.5 - 0.12 * lines) * self.ghost.size_m
        return place

    def _words(self, space: str, number: int, place: FloatArray, text: str, stamp_s: float) -> Any:
        pose = np.eye(4)
        pose[:3, 3] = place
        line = Solid(_TEXT, pose, (0.0, 0.0, 0.1 * self.ghost.size_m))
        return self._solid((space, number), line, _WORDS, stamp_s, _SHORT_S, text)

    def _solid(
        self,
        place: tuple[str, int],
        solid: Solid,
        colour: Colour,
        stamp_s: float,
        live_s: float,
        text: str = "",
    ) -> Any:
        """One marker; ``place`` is its namespace and number."""
        return cdr.make(
            "visualization_msgs/msg/Marker",
            header=cdr.header(stamp_s, self.frame),
            ns=place[0],
            id=place[1],
            type=solid.kind,
            action=0,
            pose=_pose(solid.pose),
            scale=_vector("geometry_msgs/msg/Vector3", solid.size),
            color=cdr.make("std_msgs/msg/ColorRGBA", **dict(zip("rgba", colour, strict=True))),
            lifetime=_duration(live_s),
            text=text,
            **_unused(),
        )


def _pose(pose: FloatArray) -> Any:
    x, y, z, w = quaternion(pose)
    turn = cdr.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
    place = _vector("geometry_msgs/msg/Point", pose[:3, 3].tolist())
    return cdr.make("geometry_msgs/msg/Pose", position=place, orientation=turn)


def _vector(kind: str, values: Iterable[float]) -> Any:
    return cdr.make(kind, **dict(zip("xyz", values, strict=True)))


def _duration(seconds: float) -> Any:
    whole, rest = divmod(round(seconds * 1e9), 10**9)
    return cdr.make("builtin_interfaces/msg/Duration", sec=whole, nanosec=rest)


@cache
def _unused() -> dict[str, Any]:
    """Fields of a marker that nothing here uses."""
    none = np.array([], np.uint8)
    header = cdr.header(0.0, "")
    return {
        "frame_locked": False,
        "points": [],
        "colors": [],
        "texture_resource": "",
        "texture": cdr.make("sensor_msgs/msg/CompressedImage", header=header, format="", data=none),
        "uv_coordinates": [],
        "mesh_resource": "",
        "mesh_file": cdr.make("visualization_msgs/msg/MeshFile", filename="", data=none),
        "mesh_use_embedded_materials": False,
    }
