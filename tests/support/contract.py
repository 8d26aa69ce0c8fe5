"""The message contract as a consumer gets it: from ``rampe-guard schema``."""

from __future__ import annotations

import json
from typing import Any

import jsonschema  # type: ignore[import-untyped]

from tests.support.processes import command


class Contract:
    """Validators of JSON Schema 2020-12 for every message."""

    def __init__(self) -> None:
        done = command("schema")
        assert done.returncode == 0, done.stderr
        self._validators = {}
        for name, schema in json.loads(done.stdout).items():
            jsonschema.Draft202012Validator.check_schema(schema)
            self._validators[name] = jsonschema.Draft202012Validator(schema)

    def check(self, body: dict[str, Any]) -> None:
        """Raises jsonschema.ValidationError if ``body`` breaks the schema it names."""
        self._validators[body["schema"]].validate(body)
