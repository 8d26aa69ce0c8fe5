"""``rampe-guard schema``: the written contract, printed or put into a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from rampe_guard.errors import RampeGuardError
from rampe_guard.evaluate.report_model import report_schema
from rampe_guard.programs.output import output_folder
from rampe_guard.settings import scene_schema, site_schema
from rampe_guard.view.tell import SCHEMA as WATCH_LINE
from rampe_guard.view.tell import json_line_schema
from rampe_guard.wire import json_schemas
from rampe_guard.wire.asyncapi import asyncapi_text, schema_file

ASYNCAPI: Final = "asyncapi"


def message_schemas() -> dict[str, dict[str, Any]]:
    """JSON Schema of every message, and of every line that a command prints, by its name."""
    return {**json_schemas(), WATCH_LINE: json_line_schema()}


def contract_text(name: str | None) -> str:
    """One schema, or the AsyncAPI document, or (None) all schemas as one JSON object.

    Raises:
        RampeGuardError: there is none of that name.
    """
    if name == ASYNCAPI:
        return asyncapi_text()
    schemas = {
        "site": site_schema(),
        "scene": scene_schema(),
        "report": report_schema(),
        **message_schemas(),
    }
    if name is None:
        return _text(schemas)
    if name not in schemas:
        raise RampeGuardError(f"no schema {name!r}; there are {', '.join(schemas)}, {ASYNCAPI}")
    return _text(schemas[name])


def contract_files() -> dict[str, str]:
    """Every file of the message contract: its text by its name."""
    files = {schema_file(name): _text(schema) for name, schema in message_schemas().items()}
    return files | {"asyncapi.yaml": asyncapi_text()}


def write_contract(folder: str | Path) -> None:
    """Write the contract into ``folder``; schemas of messages that are no more go.

    Raises:
        RampeGuardError: the folder cannot be written into.
    """
    folder = output_folder(folder)
    files = contract_files()
    for old in folder.glob("rampe.*.schema.json"):
        if old.name not in files:
            old.unlink()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _text(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"
