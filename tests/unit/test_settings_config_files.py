"""The files in config/: schemas are current, and every site loads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

from rampe_guard.settings import load_site, scene_schema, site_schema
from rampe_guard.settings.schema import schema_text, write_schemas
from rampe_guard.settings.source import parse

CONFIG = Path(__file__).resolve().parents[2] / "config"
SITES = sorted((CONFIG / "sites").glob("*.yaml"))


def described(schema: dict[str, Any]) -> list[str]:
    """Properties of a schema that have no description."""
    parts = [("", schema), *schema.get("$defs", {}).items()]
    return [
        f"{where}.{name}"
        for where, part in parts
        for name, field in part.get("properties", {}).items()
        if not field.get("description")
    ]


@pytest.mark.parametrize(("name", "schema"), [("site", site_schema()), ("scene", scene_schema())])
def test_schema_file_is_current(name: str, schema: dict[str, Any]) -> None:
    text = (CONFIG / f"{name}.schema.json").read_text(encoding="utf-8")
    assert text == schema_text(schema), "run: python -m rampe_guard.settings config"
    jsonschema.Draft202012Validator.check_schema(schema)
    assert described(schema) == []


def test_schemas_are_written_where_asked(tmp_path: Path) -> None:
    write_schemas(tmp_path)
    assert json.loads((tmp_path / "site.schema.json").read_text(encoding="utf-8")) == site_schema()


@pytest.mark.skipif(not SITES, reason="no site files yet")
@pytest.mark.parametrize("path", SITES, ids=lambda path: path.name)
def test_every_site_loads_and_fits_the_schema(path: Path) -> None:
    site = load_site(path)
    plain = json.loads(json.dumps(parse(path.read_bytes(), path.name).data))
    jsonschema.validate(plain, site_schema())
    scene = Path(site.scene.path)
    plain = json.loads(json.dumps(parse(scene.read_bytes(), scene.name).data))
    jsonschema.validate(plain, scene_schema())


def test_schema_refuses_what_the_loader_refuses() -> None:
    bad = {"objects": [{"name": "a", "type": "box", "size": [1, 1]}]}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(bad, scene_schema())
