"""JSON Schemas of site and scene files, for editors.

``python -m rampe_guard.settings config`` writes them into ``config``.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from rampe_guard.settings.scene_model import SceneModel
from rampe_guard.settings.site_model import SiteModel

if TYPE_CHECKING:
    from pathlib import Path

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class _Untitled(GenerateJsonSchema):
    """Without the titles that pydantic makes up from field names."""

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002 - its signature
        return False


def site_schema() -> dict[str, Any]:
    """JSON Schema 2020-12 of a site file."""
    return _schema(SiteModel, "rampe-guard site file")


def scene_schema() -> dict[str, Any]:
    """JSON Schema 2020-12 of a scene file."""
    return _schema(SceneModel, "rampe-guard scene file")


def schema_text(schema: dict[str, Any]) -> str:
    """The schema as it stands in its file."""
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def write_schemas(directory: Path) -> None:
    """Write both schemas into ``directory``."""
    for name, schema in (("site", site_schema()), ("scene", scene_schema())):
        (directory / f"{name}.schema.json").write_text(schema_text(schema), encoding="utf-8")


def _schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    schema = model.model_json_schema(by_alias=True, schema_generator=_Untitled)
    return {"$schema": DIALECT, **schema, "title": title}
