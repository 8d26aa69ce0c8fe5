"""The command line as Markdown, from its own parser."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator

WIDTH = 80
"""Of a usage line [characters]."""


def commands(parser: argparse.ArgumentParser, text: str = "") -> Iterator[tuple[str, str]]:
    """Every command that does something: its words, such as ``scene put``, and its section."""
    below = _actions(parser)
    if below is None:
        yield parser.prog.partition(" ")[2], _section(parser, text)
        return
    helps = {choice.dest: choice.help or "" for choice in below._choices_actions}  # noqa: SLF001 - argparse tells the help of a command nowhere else
    for name, command in below.choices.items():
        yield from commands(command, helps.get(name, ""))


def markdown(parser: argparse.ArgumentParser) -> str:
    """One section for each command."""
    return "\n".join(
        f"(command-{words.replace(' ', '-')})=\n## `{words}`\n\n{section}"
        for words, section in commands(parser)
    )


def _actions(parser: argparse.ArgumentParser) -> argparse._SubParsersAction | None:  # type: ignore[type-arg]
    kinds = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001 - argparse has no other way to list commands
    return next(kinds, None)


def _section(parser: argparse.ArgumentParser, text: str) -> str:
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, width=WIDTH)
    usage = parser.format_usage().removeprefix("usage: ").rstrip()
    words = text or parser.description or ""
    lines = [f"{words[:1].upper()}{words[1:]}.".replace("..", "."), ""]
    lines += ["```text", usage, "```", "", "| | |", "|---|---|"]
    for action in parser._actions:  # noqa: SLF001 - as above
        if not isinstance(action, argparse._HelpAction):  # noqa: SLF001 - its kind
            lines.append(f"| {_shown(action)} | {_help(action)} |")
    return "\n".join([*lines, ""])


def _shown(action: argparse.Action) -> str:
    if not action.option_strings:
        many = "..." if action.nargs in {"*", "+"} else ""
        return f"`{action.metavar or action.dest.upper()}{many}`"
    value = ""
    if action.nargs != 0:
        choices = "|".join(map(str, action.choices)) if action.choices else None
        value = str(choices or action.metavar or action.dest.upper()).replace("|", "\\|")
        value = f" [{value}]" if action.nargs == "?" else f" {value}"
    again = " …" if isinstance(action, argparse._AppendAction) else ""  # noqa: SLF001 - its kind
    return ", ".join(f"`{option}{value}`{again}" for option in action.option_strings)


def _help(action: argparse.Action) -> str:
    text = (action.help or "") % {"default": action.default} if action.help else ""
    required = "**required**; " if action.option_strings and action.required else ""
    return required + re.sub(r"\s+", " ", text).replace("|", "\\|").replace("<", "&lt;")
