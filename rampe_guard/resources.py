"""Where the geometry and configuration that we ship are: in the wheel, or in the checkout."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_dir() -> Path:
    """The folder that holds geometry/ and config/."""
    packed = _PACKAGE / "_data"
    return packed if packed.is_dir() else _PACKAGE.parent


def shipped_site(name: str) -> Path:
    """Path of one of our own site files ("demo", "bench")."""
    return data_dir() / "config" / "sites" / f"{name}.yaml"
