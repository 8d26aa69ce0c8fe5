"""How large a mesh file may be."""

from __future__ import annotations

from typing import Final

from rampe_guard.errors import GeometryError

MAX_TRIANGLES: Final = 2_000_000
MAX_BYTES: Final = 2**30
"""Larger files are refused unread: two million triangles need half of it in the wordiest format."""


def refuse_too_many(triangles: int, name: str) -> None:
    """Refuse a mesh of more than MAX_TRIANGLES.

    Raises:
        GeometryError: naming ``name`` and the number.
    """
    if triangles > MAX_TRIANGLES:
        raise GeometryError(
            f"{name}: {triangles} triangles; more than {MAX_TRIANGLES} are refused, simplify it"
        )
