"""JSON Schemas as Markdown: a section for each block of a file or message, a row for each field."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Schema = Mapping[str, Any]
_BOUNDS = (("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤"))


@dataclass(frozen=True, slots=True)
class Block:
    """One object within a schema.

    Attributes:
        path: where it stands, such as ``arm.actuators[]``; empty for the whole.
        name: of its definition in the schema; empty for the whole.
        text: what it is.
        fields: schema of each field.
        required: fields that must be there.
    """

    path: str
    name: str
    text: str
    fields: Mapping[str, Schema]
    required: frozenset[str]


def blocks(schema: Schema) -> list[Block]:
    """All objects of a schema in the order of reading; one that occurs again stands once."""
    found: list[Block] = []
    seen: set[str] = set()

    def visit(path: str, name: str, node: Schema) -> None:
        required = frozenset(node.get("required", ()))
        fields = node.get("properties", {})
        found.append(Block(path, name, node.get("description", ""), fields, required))
        for key, field in fields.items():
            for ref, suffix in _refs(field):
                if ref not in seen:
                    seen.add(ref)
                    visit(f"{path}.{key}{suffix}".lstrip("."), ref, schema["$defs"][ref])

    visit("", "", schema)
    return found


def markdown(schema: Schema, *, prefix: str, level: int, left_out: str) -> str:
    """Sections and tables of a schema.

    Args:
        schema: JSON Schema 2020-12.
        prefix: of the link targets, unique on the site.
        level: of the headings of inner blocks; the whole has none of its own.
        left_out: head of the column that tells what holds for a field that is not there.
    """
    all_blocks = blocks(schema)
    place = {block.name: _target(prefix, block.path) for block in all_blocks if block.name}
    lines: list[str] = []
    for block in all_blocks:
        if block.path:
            lines += [f"({_target(prefix, block.path)})=", f"{'#' * level} `{block.path}`", ""]
        lines += [cell(block.text), ""]
        if not block.fields:
            continue
        lines += [f"| field | is | {left_out} | means |", "|---|---|---|---|"]
        for key, field in block.fields.items():
            default = "**required**" if key in block.required else _default(field)
            text = cell(field.get("description", ""))
            lines.append(f"| `{key}` | {kind(field, place)} | {default} | {text} |")
        lines.append("")
    return "\n".join(lines)


def kind(node: Schema, place: Mapping[str, str]) -> str:
    """What a value is, in words; blocks as links to where ``place`` says that they stand."""
    if "$ref" in node:
        name = _name(node["$ref"])
        return f"[block](#{place[name]})" if name in place else f"`{name}`"
    for several in ("anyOf", "oneOf"):
        if several in node:
            return _either(node, several, place)
    words = [node["const"]] if "const" in node else node.get("enum", ())
    return " · ".join(f"`{word}`" for word in words) or _typed(node, place)


def _typed(node: Schema, place: Mapping[str, str]) -> str:
    match node.get("type"):
        case "array" if "prefixItems" in node:
            return "list: " + ", ".join(kind(item, place) for item in node["prefixItems"])
        case "array":
            least, most = node.get("minItems"), node.get("maxItems")
            count = f"{least} times " if least is not None and least == most else "list of "
            return count + kind(node.get("items", {}), place)
        case "object" if isinstance(node.get("additionalProperties"), dict):
            return f"by name: {kind(node['additionalProperties'], place)}"
        case str(word):
            bounds = [f"{sign} {node[key]:g}" for key, sign in _BOUNDS if key in node]
            return " ".join((word, ", ".join(bounds))).strip()
        case list(words):
            return " or ".join(words)
    return "anything"


def _either(node: Schema, several: str, place: Mapping[str, str]) -> str:
    if "discriminator" in node:
        mapping = node["discriminator"]["mapping"]
        words = [f"[`{word}`](#{place[_name(ref)]})" for word, ref in mapping.items()]
        return f"block with `{node['discriminator']['propertyName']}` " + " · ".join(words)
    return " or ".join(dict.fromkeys(kind(option, place) for option in node[several]))


def _refs(node: Schema) -> Iterator[tuple[str, str]]:
    """Definitions that a field leads to, and what they add to its path."""
    if "$ref" in node:
        yield _name(node["$ref"]), ""
    if "discriminator" in node:
        prop = node["discriminator"]["propertyName"]
        for word, ref in node["discriminator"]["mapping"].items():
            yield _name(ref), f" ({prop}: {word})"
        return
    for option in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _refs(option)
    for key, mark in (("items", "[]"), ("additionalProperties", ".NAME")):
        if isinstance(node.get(key), dict):
            yield from ((ref, mark + suffix) for ref, suffix in _refs(node[key]))


def _default(field: Schema) -> str:
    if "default" not in field:
        return ""
    value = field["default"]
    if isinstance(value, dict):
        return "" if value else "`{}`"  # its own section tells the parts
    return f"`{json.dumps(value, ensure_ascii=False)}`"


def _name(ref: str) -> str:
    return ref.rpartition("/")[2]


def _target(prefix: str, path: str) -> str:
    return f"{prefix}-{re.sub(r'[^a-z0-9]+', '-', path.lower()).strip('-')}"


def cell(text: str) -> str:
    """Words that stand in a cell as they are: no bar ends it, no angle reads as HTML."""
    return re.sub(r"\s+", " ", text).replace("|", "\\|").replace("<", "&lt;").strip()
