"""Every command that the README shows is one that the program takes."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from rampe_guard.cli import _parser

README = Path(__file__).parents[2] / "README.md"


def commands() -> list[str]:
    """Lines of shell blocks, from the program's name up to a pipe or a comment."""
    blocks = re.findall(r"```sh\n(.*?)```", README.read_text("utf-8"), re.DOTALL)
    text = "\n".join(blocks).replace("\\\n", " ")
    return re.findall(r"(?:^|[|/&] ?)rampe-guard ([^|\n]*)", text, re.MULTILINE)


@pytest.mark.parametrize("line", commands())
def test_the_parser_takes_it(line: str) -> None:
    args = _parser().parse_args(shlex.split(line, comments=True))
    assert callable(args.command)


def test_they_are_found() -> None:
    words = {line.split()[0] for line in commands()}
    assert {"demo", "watch", "record", "replay", "evaluate", "sweep", "notify"} <= words
