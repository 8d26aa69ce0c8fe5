"""Every command that README and pages show is one that the program takes, run or not."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from rampe_guard.cli import _parser
from tests.support.pages import DOCS, README, Fence, consoles, fences, pages


def lines(page: Path) -> list[str]:
    """Arguments of every ``rampe-guard`` in the shell blocks of a page."""
    blocks = ["\n".join(f.text) for f in fences(page) if f.language == "sh"]
    blocks += [command for fence in consoles(page) for command in fence.commands]
    text = "\n".join(blocks).replace("\\\n", " ")
    return re.findall(r"(?:^|[|/&;] ?|until |if )rampe-guard ([^|;&<>\n]*)", text, re.MULTILINE)


COMMANDS = [(page.stem, line) for page in pages() for line in lines(page)]


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_the_parser_takes_it(page: str, line: str) -> None:  # noqa: ARG001 - names the case
    words = shlex.split(line, comments=True)
    if "--help" in words:
        with pytest.raises(SystemExit) as ended:
            _parser().parse_args(words)
        assert ended.value.code == 0
        return
    args = _parser().parse_args(words)
    assert callable(args.command)


def test_they_are_found() -> None:
    words = {line.split()[0] for _, line in COMMANDS}
    assert {"demo", "check", "record", "replay", "evaluate", "sweep", "notify", "init"} <= words


def test_commands_of_pages_can_be_run_or_say_why_not() -> None:
    """A block ``sh`` in a page would be run by nobody."""
    shells = {"sh", "bash", "shell", "zsh"}
    found = [f"{f.page.name}:{f.line}" for p in pages() for f in fences(p) if f.language in shells]
    assert [where for where in found if not where.startswith(README.name)] == []


@pytest.mark.parametrize("page", [p for p in pages() if DOCS in p.parents], ids=lambda p: p.stem)
def test_a_console_holds_commands(page: Path) -> None:
    for fence in consoles(page):
        assert fence.commands, f"{page.name}:{fence.line}: no line begins with '$ '"


def test_a_page_is_read_as_a_reader_would(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "1. one\n\n   <!-- exit code: 2 -->\n   ```console\n   $ a \\\n   >   b\n   said\n"
        "   $ cat > c <<'END'\n   $ no command\n   END\n   $ d &\n   ```\n"
        "<!-- not run: a robot -->\n```console\n$ e\n```\n\n```yaml\n$ f\n```\n"
    )
    first, second = consoles(page)
    assert first == Fence(page, 5, "console", first.text, {"exit code": "2"})
    assert first.commands == ["a \\\n  b", "cat > c <<'END'\n$ no command\nEND", "d &"]
    assert (second.notes, second.commands) == ({"not run": "a robot"}, ["e"])
