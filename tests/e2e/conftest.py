"""Fixtures of the end-to-end tests: everything runs as processes on loopback."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from jsonschema import Draft202012Validator

from tests.support import processes
from tests.support.station import Station, station


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """A running guard of the bench site with its machine, shared by a module."""
    with station(tmp_path_factory.mktemp("live")) as made:
        yield made


@pytest.fixture(scope="session")
def validators() -> dict[str, Draft202012Validator]:
    """A validator for each message, from what ``rampe-guard schema`` prints."""
    done = processes.command("schema")
    assert done.returncode == 0, done.stderr
    found = {}
    for name, schema in json.loads(done.stdout).items():
        Draft202012Validator.check_schema(schema)
        found[name] = Draft202012Validator(schema)
    return found
