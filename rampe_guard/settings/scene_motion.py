"""Which objects of a scene may move, and on which keys their poses come."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rampe_guard.settings.check import wrong_key
from rampe_guard.settings.problems import KeyPath, Problems, show
from rampe_guard.settings.scene_model import DEFAULT_TIMEOUT_S, MovableModel
from rampe_guard.settings.source import Document

_FIXED = {"halfspace": "a halfspace", "actuator_limit": "an actuator limit"}
_FIELDS = ("key", "max_speed", "timeout_s")


def refuse_fixed(document: Document) -> None:
    """Refuse a key on what cannot move, before it is reported as a mere unknown word.

    Raises:
        SettingsError: a halfspace or an actuator limit has one.
    """
    data = document.data
    items = data.get("objects") if isinstance(data, dict) else None
    problems = Problems(document)
    for index, item in enumerate(items if isinstance(items, tuple) else ()):
        kind = item.get("type") if isinstance(item, dict) else None
        if isinstance(kind, str) and kind in _FIXED:
            for field in (name for name in _FIELDS if name in item):
                what = f"{_FIXED[kind]} cannot move"
                remedy = "remove it, or describe what moves as a box, capsule or mesh"
                problems.add(("objects", index, field), what, remedy)
    problems.raise_if_any()


class Motions:
    """Checks how each object moves; every key may be used once.

    Args:
        problems: where mistakes are noted.
        taken: keys that mean something else at the site, and what.
    """

    def __init__(self, problems: Problems, taken: Mapping[str, str]) -> None:
        self._problems = problems
        self._taken = dict(taken)

    def of(self, item: MovableModel, where: KeyPath) -> dict[str, Any]:
        """``key``, ``max_speed`` [m/s] and ``timeout_s`` [s] of an object that may have a key."""
        if item.key is None:
            for field in _FIELDS[1:]:
                if getattr(item, field) is not None:
                    what = "means nothing for an object without key"
                    self._problems.add((*where, field), what, "remove it, or give the key too")
            return {}
        self._check(item.key, item.name, (*where, "key"))
        if item.max_speed is None:
            what = "is missing, and an object with a key moves"
            remedy = "give the top speed of any point of it [m/s]"
            self._problems.add((*where, "max_speed"), what, remedy)
            return {}
        timeout_s = DEFAULT_TIMEOUT_S if item.timeout_s is None else item.timeout_s
        return {"key": item.key, "max_speed": item.max_speed, "timeout_s": timeout_s}

    def _check(self, key: str, name: str, where: KeyPath) -> None:
        if wrong := wrong_key(key):
            what = f"{show(key)} {wrong}"
            self._problems.add(where, what, "give an exact Zenoh key such as a/b/c")
        elif key in self._taken:
            what = f"{show(key)} is {self._taken[key]} already"
            self._problems.add(where, what, "give every object a key of its own")
        self._taken.setdefault(key, f"the key of object {show(name)}")
