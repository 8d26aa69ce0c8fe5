"""The contract as one AsyncAPI 3 document.

Payloads are references to the JSON Schemas, which lie beside the document under the names of
the messages. AsyncAPI knows no binding for Zenoh: what it has to say stands in ``x-zenoh``.
"""

from __future__ import annotations

import io
import re
from typing import Any, Final

from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import LiteralScalarString

from rampe_guard.wire.channels import KEYS, PARAMETERS, Key
from rampe_guard.wire.schema import json_schemas

CONTRACT_VERSION: Final = "1.4.0"
"""Grows in the middle with every addition; the first number is the ``v1`` of the messages."""
_SCHEMA_FORMAT = "application/schema+json;version=2020-12"
_RULES = """\
The guard is the application: it `receive`s inputs and queries, and `send`s the rest.

All payloads are UTF-8 JSON without NaN or Infinity; null is "unknown". Numbers carry their
unit at the end of their name (or of the name around them); positions, displacements and
velocities of actuators are in the site's units, rad or m, and `stamp` in seconds.

Version 1 may grow: fields, keys, reasons and refusals may be added. Consumers ignore fields
and keys that they do not know, and show a reason that they do not know. A field that goes,
changes its type, unit or meaning, or a new word in a closed set, makes version 2, on keys of
its own beside version 1. What cannot be decoded counts as lost, and never as clear.
"""


def asyncapi() -> dict[str, Any]:
    """The document as plain dicts and lists."""
    used = sorted({name for key in KEYS for name in (key.message, key.reply) if name})
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "rampe-guard",
            "version": CONTRACT_VERSION,
            "description": _RULES,
            "license": {
                "name": "Apache-2.0",
                "url": "https://www.apache.org/licenses/LICENSE-2.0",
            },
        },
        "defaultContentType": "application/json",
        "servers": {
            "router": {
                "host": "127.0.0.1:7447",
                "protocol": "zenoh",
                "description": "A Zenoh router; the guard and its consumers are its clients.",
            }
        },
        "channels": {key.name: _channel(key) for key in KEYS},
        "operations": {_operation_name(key): _operation(key) for key in KEYS},
        "components": {
            "parameters": {
                name: {"description": text, "examples": [example]}
                for name, (text, example) in PARAMETERS.items()
            },
            "messages": {name: _message(name) for name in used} | {"error": _ERROR},
        },
    }


def asyncapi_text() -> str:
    """The document as YAML, as it stands in its file."""
    yaml = YAML()
    yaml.width = 96
    yaml.indent(mapping=2, sequence=4, offset=2)
    out = io.StringIO()
    yaml.dump(_literal(asyncapi()), out)
    return out.getvalue()


def schema_file(message: str) -> str:
    """Name of the file that holds the schema of ``message``."""
    return f"{message}.schema.json"


_ERROR: Final = {
    "name": "error",
    "title": "Refusal",
    "summary": "Why a query was refused, in words; a Zenoh error reply.",
    "contentType": "text/plain",
    "payload": {"type": "string"},
}


def _message(name: str) -> dict[str, Any]:
    summary: str = json_schemas()[name]["description"]
    return {
        "name": name,
        "title": name.removeprefix("rampe.").replace("_", " ").replace(".", " "),
        "summary": " ".join(summary.split()),
        "payload": {
            "schemaFormat": _SCHEMA_FORMAT,
            "schema": {"$ref": f"./{schema_file(name)}"},
        },
    }


def _channel(key: Key) -> dict[str, Any]:
    named = re.findall(r"{(\w+)}", key.address)
    messages = [name for name in (key.message, key.reply) if name]
    if key.reply is not None:
        messages.append("error")
    channel: dict[str, Any] = {
        "address": key.address,
        "description": key.text,
        "parameters": {name: {"$ref": f"#/components/parameters/{name}"} for name in named},
    }
    if messages:
        channel["messages"] = {
            _local(name): {"$ref": f"#/components/messages/{name}"} for name in messages
        }
    return channel


def _operation_name(key: Key) -> str:
    verb = {"taken": "take", "published": "publish", "answered": "answer", "held": "hold"}
    return verb[key.way] + key.name[0].upper() + key.name[1:]


def _operation(key: Key) -> dict[str, Any]:
    def of(message: str) -> dict[str, str]:
        return {"$ref": f"#/channels/{key.name}/messages/{_local(message)}"}

    operation: dict[str, Any] = {
        "action": "send" if key.way in {"published", "held"} else "receive",
        "channel": {"$ref": f"#/channels/{key.name}"},
        "summary": key.text.split(";")[0].split(". ")[0].rstrip("."),
    }
    # an empty list would mean none; absent means all of the channel's
    if key.way != "held":
        operation["messages"] = [] if key.message is None else [of(key.message)]
    if key.reply is not None:
        operation["reply"] = {
            "channel": {"$ref": f"#/channels/{key.name}"},
            "messages": [of(key.reply), of("error")],
        }
    operation["bindings"] = {"x-zenoh": _quality(key)}
    return operation


def _quality(key: Key) -> dict[str, Any]:
    if key.way == "taken":
        return {"entity": "subscriber"}
    if key.way == "answered":
        return {"entity": "queryable", "replyEncoding": "application/json"}
    if key.way == "held":
        return {"entity": "liveliness token"}
    return {
        "entity": "publisher",
        "priority": "REAL_TIME" if key.urgent else "DATA",
        "congestionControl": "DROP",
        "express": True,
        "reliability": "RELIABLE",
        "encoding": f"application/json;{key.message}",
    }


def _local(message: str) -> str:
    """Name of a message within its channel: without prefix and version."""
    return message.removeprefix("rampe.").split(".")[0]


def _literal(value: Any) -> Any:
    """The same with texts of several lines as blocks, which people can read."""
    if isinstance(value, dict):
        return {key: _literal(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_literal(item) for item in value]
    if isinstance(value, str) and "\n" in value:
        return LiteralScalarString(value)
    return value
