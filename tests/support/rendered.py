"""What a terminal would show, as text."""

from __future__ import annotations

import io

from rich.console import Console, RenderableType


def shown(renderable: RenderableType, width: int = 80, *, styles: bool = False) -> str:
    """The picture in ``width`` cells, with its escape codes if ``styles``."""
    console = Console(
        record=True,
        width=width,
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
        legacy_windows=False,
    )
    console.print(renderable)
    return console.export_text(styles=styles)


def line_of(text: str, word: str) -> str:
    """The first line with ``word`` in it."""
    return next(line for line in text.splitlines() if word in line)
