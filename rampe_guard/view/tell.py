"""What happens to machines as lines: for people on a pipe and among events, as JSON for scripts."""

from __future__ import annotations

from typing import Any, Final

import msgspec

from rampe_guard.client.items import Alert, Item, ProtectionLost
from rampe_guard.core.alarm import Level
from rampe_guard.view.marks import ALARMING

SCHEMA: Final = "rampe.watch_line.v1"
_TOLD: Final = {
    "description": "Unix time at which the line was written [s].",
    "type": "number",
}


def worth_a_line(item: Item) -> bool:
    """Whether to tell people: that nobody monitors is an alert too, but protection tells it."""
    if not isinstance(item, Alert) or item.source != "system":
        return True
    return item.urgency is Level.CAUTION


def words(item: Item) -> str:
    """What happened, for people."""
    if not isinstance(item, Alert):
        return item.text
    if item.inhibit == "shelved":
        return f"{item.text} (shelved by {item.shelved_by})"
    if item.state == "acked":
        return f"{item.text} (seen by {item.acked_by})"
    if item.state == "rtn_unacked":
        return f"{item.text} (please acknowledge)"
    return item.text


def lost(item: Item) -> bool:
    """Somebody should be protected and is not."""
    return isinstance(item, ProtectionLost) and item.protection in ALARMING


def json_line(item: Item, unix_s: float) -> bytes:
    """The item as one JSON object, with the time of the line [s]; null is unknown."""
    return msgspec.json.encode({**msgspec.to_builtins(item), "told_unix_s": unix_s})


def json_line_schema() -> dict[str, Any]:
    """JSON Schema 2020-12 of such a line."""
    (_,), definitions = msgspec.json.schema_components([Item], ref_template="#/$defs/{name}")
    kinds: dict[str, Any] = {}
    for kind in Item.__args__:
        name = kind.__name__
        schema = definitions.pop(name)
        schema["description"] = schema["description"].partition("\n")[0]
        schema["properties"]["event"]["description"] = "What kind of line this is."
        schema["properties"]["told_unix_s"] = _TOLD
        schema["required"] = list(schema["properties"])
        kinds[name] = schema
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:{SCHEMA.replace('.', ':')}",
        "description": "One line of `rampe-guard watch --json`.",
        "anyOf": [{"$ref": f"#/$defs/{name}"} for name in kinds],
        "$defs": {**kinds, **definitions},
    }
