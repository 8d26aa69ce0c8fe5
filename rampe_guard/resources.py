"""Where the geometry and configuration that we ship are: in the wheel, or in the checkout."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_dir() -> Path:
    """The folder that holds geometry/ and config/."""
    packed = _PACKAGE / "_data"
    return packed if packed.is_dir() else _PACKAGE.parent


def shipped_site(name: str) -> Path:
    """Path of one of our own site files ("demo", "bench")."""
    return data_dir() / "config" / "sites" / f"{name}.yaml"


def shipped_instead(args: Namespace, say: Callable[[str], None]) -> None:
    """Take our own file where a command names one that is not here: ``config/sites/demo.yaml``.

    Args:
        args: of a command; what it writes (``out``) is left as it is.
        say: told which file was taken.
    """

    def found(name: object) -> object:
        if not isinstance(name, str) or not name.startswith(("config/", "geometry/")):
            return name
        ours = data_dir() / name
        if Path(name).exists() or ".." in ours.parts or not ours.is_file():
            return name
        say(f"{name}: not here; the one that rampe-guard ships is taken")
        return str(ours)

    for key, value in vars(args).items():
        if key != "out":
            setattr(args, key, [*map(found, value)] if isinstance(value, list) else found(value))
