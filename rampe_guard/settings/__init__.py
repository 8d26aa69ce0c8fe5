"""Site and scene files: YAML → checked models → core values, errors with file and line.

::

    source (YAML, lines) → explain.validate (pydantic models) → check → site / scene (core)
"""

from rampe_guard.settings.scene import load_scene, parse_scene
from rampe_guard.settings.schema import scene_schema, site_schema
from rampe_guard.settings.site import for_operator, load_scene_text, load_site
from rampe_guard.settings.site_model import DEFAULT_ENDPOINT
from rampe_guard.settings.site_types import (
    ColumnMap,
    Keys,
    LogMapping,
    MemorySettings,
    MetricsSettings,
    Site,
    TlsFiles,
    ZenohSettings,
)

__all__ = [
    "DEFAULT_ENDPOINT",
    "ColumnMap",
    "Keys",
    "LogMapping",
    "MemorySettings",
    "MetricsSettings",
    "Site",
    "TlsFiles",
    "ZenohSettings",
    "for_operator",
    "load_scene",
    "load_scene_text",
    "load_site",
    "parse_scene",
    "scene_schema",
    "site_schema",
]
