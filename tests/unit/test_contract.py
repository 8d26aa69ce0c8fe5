"""The contract in ``config/contract``: current, complete, described, and valid AsyncAPI."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest
from ruamel.yaml import YAML

from rampe_guard.errors import RampeGuardError
from rampe_guard.programs.contract import (
    contract_files,
    contract_text,
    message_schemas,
    write_contract,
)
from rampe_guard.wire.channels import KEYS, PARAMETERS

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "config" / "contract"
OFFICIAL = ROOT / "tests" / "support" / "asyncapi-3.0.0.schema.json"

UNITS = re.compile(r"_(s|ms|m|rad|hz|bytes)$")
BY_ACTUATOR = {
    "position", "velocity", "start", "displacement", "mean", "scale", "endpoint", "progress",
    "predicted_displacement", "predicted_endpoint", "witness",
}  # fmt: skip
"""In the unit of each actuator, rad or m, as its site file says."""
DIMENSIONLESS = {
    "axes", "category", "borrowed_from", "quaternion_xyzw", "dof",
    "probability", "share", "negative_share", "positive_share", "contact_fraction",
    "seq", "tick", "observations", "accepted", "rejected", "primitives", "drops", "count",
    "situations", "similar_situations", "similar_contacts", "granted", "refused", "alerts", "steps",
    "categories", "occurrences", "save_failures",
    "files", "messages", "waiting", "dropped",
}  # fmt: skip
SECONDS = {"stamp"}
"""Named by the design, before the rule."""

Field = tuple[str, str, dict[str, Any]]


def parts(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The message and each struct inside it, by name."""
    yield "", {"properties": {}, **schema}
    yield from ((n, p) for n, p in schema.get("$defs", {}).items() if "properties" in p)


def fields(schema: dict[str, Any]) -> Iterator[Field]:
    for name, part in parts(schema):
        for field, said in part["properties"].items():
            yield name, field, said


def is_number(said: Any) -> bool:
    """Whether a number stands here, or in an array or map that stands here."""
    if isinstance(said, list):
        return any(map(is_number, said))
    if not isinstance(said, dict):
        return False
    if said.get("type") in {"number", "integer"}:
        return True
    if any(
        isinstance(one, int | float) and not isinstance(one, bool) for one in said.get("enum", ())
    ):
        return True
    inside = ("anyOf", "items", "prefixItems", "additionalProperties")
    return any(is_number(said[word]) for word in inside if word in said)


def enclosing(schema: dict[str, Any], struct: str) -> set[str]:
    """Names of the fields that hold ``struct``."""
    wanted = f'"#/$defs/{struct}"'
    return {field for _, field, said in fields(schema) if wanted in json.dumps(said)}


def test_the_files_are_current() -> None:
    assert {p.name: p.read_text("utf-8") for p in FOLDER.iterdir()} == contract_files(), (
        "run: rampe-guard schema --out config/contract"
    )


def test_writing_takes_away_what_is_no_message_any_more(tmp_path: Path) -> None:
    (tmp_path / "rampe.gone.v1.schema.json").write_text("{}")
    (tmp_path / "notes.txt").write_text("mine")
    write_contract(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {*contract_files(), "notes.txt"}


def test_the_command_prints_each_of_them() -> None:
    assert contract_text("asyncapi") == contract_files()["asyncapi.yaml"]
    assert contract_text("rampe.ack.v1") == contract_files()["rampe.ack.v1.schema.json"]
    assert set(json.loads(contract_text(None))) == {"site", "scene", "report", *message_schemas()}
    with pytest.raises(RampeGuardError, match=r"'rampe.ack.v2'; there are .*rampe.ack.v1"):
        contract_text("rampe.ack.v2")


@pytest.mark.parametrize("name", message_schemas())
def test_every_number_has_its_unit_in_its_name(name: str) -> None:
    schema = message_schemas()[name]
    for struct, field, said in fields(schema):
        if not is_number(said) or field in BY_ACTUATOR | DIMENSIONLESS | SECONDS:
            continue
        around = enclosing(schema, struct) if struct else set()
        named = UNITS.search(field) or (around and all(map(UNITS.search, around)))
        assert named, f"{name}: {struct}.{field} says no unit"


def test_the_rule_of_units_can_fail() -> None:
    schema = {"properties": {"speed": {"anyOf": [{"type": "number"}, {"type": "null"}]}}}
    ((_, field, said),) = fields(schema)
    assert is_number(said)
    assert not UNITS.search(field)
    assert not is_number({"type": "array", "items": {"type": "string"}})


@pytest.mark.parametrize("name", message_schemas())
def test_everything_is_described(name: str) -> None:
    schema = message_schemas()[name]
    assert [part for part, said in parts(schema) if not said.get("description")] == []
    missing = [f"{part}.{field}" for part, field, said in fields(schema) if not described(said)]
    assert missing == []


def described(said: dict[str, Any]) -> bool:
    text: str = said.get("description", "")
    return len(text) > len("a word") and text[-1] in ".?)`"


def test_no_exception_is_kept_for_nothing() -> None:
    every = {field for schema in message_schemas().values() for _, field, _ in fields(schema)}
    assert (BY_ACTUATOR | DIMENSIONLESS | SECONDS) - every == set()


def document() -> dict[str, Any]:
    loaded: dict[str, Any] = YAML(typ="safe").load((FOLDER / "asyncapi.yaml").read_text("utf-8"))
    return loaded


def test_the_document_is_valid_asyncapi_3() -> None:
    official = json.loads(OFFICIAL.read_text("utf-8"))
    jsonschema.Draft7Validator(official).validate(document())
    broken = document()
    broken["operations"]["publishAlert"]["action"] = "emit"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft7Validator(official).validate(broken)


def references(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        if "$ref" in value:
            yield value["$ref"]
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from references(item)


def test_every_reference_leads_somewhere() -> None:
    whole = document()
    seen = set(references(whole))
    for reference in seen:
        if reference.startswith("./"):
            schema = json.loads((FOLDER / reference).read_text("utf-8"))
            jsonschema.Draft202012Validator.check_schema(schema)
            continue
        found: Any = whole
        for step in reference.removeprefix("#/").split("/"):
            found = found[step]
    on_keys = {name for key in KEYS for name in (key.message, key.reply) if name}
    assert {f"./{name}.schema.json" for name in on_keys} <= seen


def test_every_parameter_of_an_address_is_explained() -> None:
    used = {name for key in KEYS for name in re.findall(r"{(\w+)}", key.address)}
    assert used == set(PARAMETERS)
    for channel in document()["channels"].values():
        assert set(channel["parameters"]) == set(re.findall(r"{(\w+)}", channel["address"]))


def test_every_message_is_on_a_key_or_a_line() -> None:
    """What is not on a Zenoh key is a line that a command reads or prints."""
    on_keys = {name for key in KEYS for name in (key.message, key.reply) if name}
    on_lines = {"rampe.sweep_request.v1", "rampe.sweep_reply.v1", "rampe.watch_line.v1"}
    assert on_keys | on_lines == set(message_schemas())
