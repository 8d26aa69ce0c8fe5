"""What differs between two scenes, and what of the first the second protects less.

Objects are compared by name. ``weaker`` is said wherever it cannot be shown that the new object
keeps clear all that the old one did: it could not be computed is no reason to call it safe.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from rampe_guard.core.rotation import rotation_of_rpy
from rampe_guard.core.scene import ActuatorLimit, Mesh, SceneObject
from rampe_guard.scene_tools.draft import plain, rpy_of
from rampe_guard.scene_tools.given_up import given_up_m
from rampe_guard.scene_tools.scene_text import SceneText

Kind = Literal["removed", "changed", "renamed", "added"]
_GEOMETRY: Final = frozenset({
    "type", "size_m", "pose", "radius_m", "height_m", "center_m", "start_m", "end_m", "normal",
    "offset_m", "file", "mesh", "scale", "open", "margin_m",
})  # fmt: skip
_PLACES: Final = ("pose", "center_m", "start_m")
_LEAST_M: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Field:
    """One value that differs; None where there was or is none."""

    field: str
    old: Any
    new: Any


@dataclass(frozen=True, slots=True)
class Change:
    """What became of one object.

    Attributes:
        kind: removed, changed, renamed or added.
        name: of the object, the old one if it was renamed.
        type: of the object, the new one if it was changed.
        weaker: sentences on what is protected less; empty if nothing is.
        fields: what differs.
        moved_m: how far its middle, or start, is from where it was [m].
        turned_deg: by how much it was turned [deg].
        given_up_m: how deep the old space sticks out of the new [m]; None if that has no end.
    """

    kind: Kind
    name: str
    type: str
    weaker: tuple[str, ...] = ()
    fields: tuple[Field, ...] = ()
    moved_m: float = 0.0
    turned_deg: float = 0.0
    given_up_m: float | None = 0.0


def compare(old: SceneText, new: SceneText) -> tuple[Change, ...]:
    """All changes, those first after which less is protected, then in the order of the files.

    Raises:
        GeometryError, OSError: a mesh file cannot be read.
    """
    before, after = _named(old), _named(new)
    gone = {name: item for name, item in before.items() if name not in after}
    fresh = {name: item for name, item in after.items() if name not in before}
    changes: list[Change] = []
    for name, (_, values) in gone.items():
        twin = next((n for n, (_, v) in fresh.items() if v == values), None)
        if twin is not None:
            del fresh[twin]
            field = Field("name", name, twin)
            changes.append(Change("renamed", name, values["type"], (), (field,)))
            continue
        said = ("is not there any more",)
        changes.append(Change("removed", name, values["type"], said, given_up_m=None))
    changes += [
        _changed(name, before[name], after[name])
        for name in before
        if name in after and before[name][1] != after[name][1]
    ]
    changes += [Change("added", name, values["type"]) for name, (_, values) in fresh.items()]
    return tuple(sorted(changes, key=lambda change: not change.weaker))


def _named(text: SceneText) -> dict[str, tuple[SceneObject, dict[str, Any]]]:
    return {item.name: (item, _values(item, text)) for item in text.scene.objects}


def _values(item: SceneObject, text: SceneText) -> dict[str, Any]:
    """An object as plain values that can be compared and printed."""
    found: dict[str, Any] = {"type": _WORDS.get(type(item).__name__, type(item).__name__.lower())}
    for part in fields(item):
        value = getattr(item, part.name)
        if part.name == "name":
            continue
        if isinstance(value, np.ndarray):
            xyz, rpy = value[:3, 3], rpy_of(value[:3, :3])
            value = {"xyz": [plain(v) for v in xyz], "rpy": [plain(v) for v in rpy]}
        elif isinstance(value, tuple):
            value = [plain(v) if isinstance(v, float) else v for v in value]
        elif isinstance(item, ActuatorLimit) and part.name == "actuator":
            value = text.actuators[item.actuator]
        elif isinstance(item, Mesh) and part.name == "file":
            found["mesh"] = hashlib.sha256(Path(value).read_bytes()).hexdigest()[:12]
            continue  # where it lies means nothing
        found[part.name] = value
    return found


_WORDS: Final = {"ActuatorLimit": "actuator_limit"}

Seen = tuple[SceneObject, dict[str, Any]]


def _changed(name: str, before: Seen, after: Seen) -> Change:
    (old, was), (new, now) = before, after
    differ = tuple(
        Field(key, was.get(key), now.get(key))
        for key in dict.fromkeys([*was, *now])
        if was.get(key) != now.get(key)
    )
    if isinstance(old, ActuatorLimit) or isinstance(new, ActuatorLimit):
        weaker = tuple(_limit_weaker(old, new, {f.field for f in differ}))
        return Change("changed", name, now["type"], weaker, differ)
    depth = given_up_m(old, new) if any(f.field in _GEOMETRY for f in differ) else 0.0
    weaker = tuple(_weaker(differ, depth))
    moved, turned = _moved(was, now)
    deep = plain(depth) if math.isfinite(depth) else None
    return Change("changed", name, now["type"], weaker, differ, moved, turned, deep)


def _weaker(differ: tuple[Field, ...], depth: float) -> Iterator[str]:
    by_name = {field.field: field for field in differ}
    if depth > _LEAST_M:
        much = f"up to {depth:.3g} m" if math.isfinite(depth) else "no telling how much"
        yield f"space that was kept clear is not any more: {much}"
    margin = by_name.get("margin_m")
    if margin is not None and not (margin.old or 0.0) <= (margin.new or 0.0):
        yield f"margin {margin.old:g} m -> {margin.new:g} m"
    for field in (f for key, f in by_name.items() if key in _LOOSER):
        if _LOOSER[field.field](field.old, field.new):
            yield f"{field.field} {field.old} -> {field.new}"


def _more_links(old: list[str], new: list[str]) -> bool:
    return not set(new) <= set(old)


_LOOSER: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "ignore_links": _more_links,
    "key": lambda _old, _new: True,  # what places it is not what placed it
    "max_speed": lambda old, new: new < old,
    "timeout_s": lambda old, new: new > old,
}


def _limit_weaker(old: SceneObject, new: SceneObject, differ: set[str]) -> Iterator[str]:
    if not (isinstance(old, ActuatorLimit) and isinstance(new, ActuatorLimit)):
        yield "is of another kind"
        return
    if "actuator" in differ:
        yield "is of another actuator"
    for key, way in (("above", 1.0), ("below", -1.0)):
        was, now = getattr(old, key), getattr(new, key)
        if was is not None and (now is None or way * now > way * was):
            yield f"{key} {was:g} -> {'none' if now is None else f'{now:g}'}"


def _moved(was: dict[str, Any], now: dict[str, Any]) -> tuple[float, float]:
    """How far [m], and by how much it is turned [deg]."""
    for key in _PLACES:
        a, b = was.get(key), now.get(key)
        if a is None or b is None:
            continue
        if key != "pose":
            return plain(math.dist(a, b)), 0.0
        turn = rotation_of_rpy(a["rpy"]).T @ rotation_of_rpy(b["rpy"])
        twice_sine = np.linalg.norm(turn - turn.T) / math.sqrt(2.0)
        angle = math.degrees(math.atan2(float(twice_sine), float(np.trace(turn)) - 1.0))
        return plain(math.dist(a["xyz"], b["xyz"])), round(angle, 6) + 0.0
    return 0.0, 0.0
