"""``rampe-guard scene diff``: what a new version of a scene protects less, and what differs."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import Any, Final

import msgspec

from rampe_guard.scene_tools.compare import Change, Field, compare
from rampe_guard.scene_tools.scene_text import read_either

SAME: Final = 0
DIFFERENT: Final = 1
FORMAT: Final = "rampe.scene_diff.v1"
_LEAST_M: Final = 1e-6


def diff_scenes(old: str, new: str, allow: Sequence[str], *, as_json: bool) -> int:
    """Print what differs; the exit code is 0 if nothing does, else 1.

    Raises:
        SettingsError, GeometryError: a file is wrong.
    """
    before, after = (read_either(path, tuple(allow))[0] for path in (old, new))
    changes = compare(before, after)
    if as_json:
        found = {"format": FORMAT, "old": old, "new": new, "same": not changes, "changes": changes}
        sys.stdout.write(msgspec.json.encode(found).decode() + "\n")
    else:
        for line in _lines(changes):
            sys.stdout.write(f"{line}\n")
    return DIFFERENT if changes else SAME


def _lines(changes: Sequence[Change]) -> Iterator[str]:
    weaker = [change for change in changes if change.weaker]
    if not changes:
        yield "the same objects"
    if weaker:
        yield f"LESS PROTECTED: {len(weaker)} of {len(changes)} changes"
        for change in weaker:
            yield from _change(change)
    if len(weaker) < len(changes):
        if weaker:
            yield ""
        yield "nothing of these is protected less:" if weaker else "nothing is protected less:"
        for change in changes[len(weaker) :]:
            yield from _change(change)


def _change(change: Change) -> Iterator[str]:
    yield f"  {change.kind:8} {change.name} ({change.type})"
    for words in change.weaker:
        yield f"           ! {words}"
    if change.moved_m > _LEAST_M:
        yield f"           moved {change.moved_m:.3g} m"
    if change.turned_deg:
        yield f"           turned {change.turned_deg:.3g} deg"
    for field in change.fields:
        yield f"           {_field(field)}"


def _field(field: Field) -> str:
    return f"{field.field}: {_value(field.old)} -> {_value(field.new)}"


def _value(value: Any) -> str:
    if value is None:
        return "-"
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()
