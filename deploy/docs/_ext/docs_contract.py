"""The message contract as Markdown: the keys, and every message with its fields."""

from __future__ import annotations

import json
from pathlib import Path

import docs_schema

from rampe_guard.wire.channels import KEYS, PARAMETERS


def keys() -> str:
    """A table of the keys."""
    lines = ["| key | by the guard | message | when, and what for |", "|---|---|---|---|"]
    for key in KEYS:
        asked, answer = (_link(name) if name else "" for name in (key.message, key.reply))
        what = f"{asked} → {answer}" if answer else asked
        urgent = " Before all other traffic." if key.urgent else ""
        text = f"{docs_schema.cell(key.text)}{urgent}"
        lines.append(f"| `{key.address}` | {key.way} | {what} | {text} |")
    lines += ["", "| in braces | is | such as |", "|---|---|---|"]
    for word, (text, example) in PARAMETERS.items():
        lines.append(f"| `{word}` | {docs_schema.cell(text)} | `{example}` |")
    return "\n".join([*lines, ""])


def messages(contract: Path) -> str:
    """A section for each message: its schema as a table."""
    parts = []
    for path in sorted(contract.glob("*.schema.json")):
        schema = json.loads(path.read_text("utf-8"))
        name = path.name.removesuffix(".schema.json")
        body = docs_schema.markdown(schema, prefix=_target(name), level=3, left_out="if not there")
        parts.append(f"({_target(name)})=\n## `{name}`\n\n{body}")
    return "\n".join(parts)


def _link(name: str) -> str:
    return f"[`{name}`](#{_target(name)})" if name.startswith("rampe.") else f"`{name}`"


def _target(name: str) -> str:
    return f"message-{name.replace('.', '-').replace('_', '-')}"
