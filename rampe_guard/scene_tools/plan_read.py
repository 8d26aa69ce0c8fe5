"""GeoJSON (RFC 7946) site plans as outlines in metres with heights.

The standard's coordinates are degrees of longitude and latitude, yet drawing programs write metres
into it just as well. Which of the two is never guessed: the file's ``crs`` says it, or the caller.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError
from rampe_guard.settings.problems import show
from rampe_guard.settings.source import read_bytes

_MOST_BYTES: Final = 64 * 2**20
_DEEPEST: Final = 64
_LENGTHS: Final = ("height_m", "base_m", "radius_m", "width_m", "margin_m")
_KNOWN: Final = ("name", *_LENGTHS)
_MOST_M: Final = 20_000.0
ORIGIN_MOST_M: Final = 5000.0
"""So far from --origin the local plane is used [m]: distances in it are right to 0.6 mm there."""
_A: Final = 6_378_137.0
_E2: Final = 6.694379990141e-3
"""WGS 84: half the long axis [m], and the eccentricity squared."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One point, line or polygon of a plan.

    Attributes:
        where: file and feature, for messages.
        name: of the feature; None if it has none.
        kind: ``Point``, ``LineString`` or ``Polygon``.
        rings: coordinates x, y, z of each ring (n, 3) [m]; one for a point or a line.
        has_z: whether the file gives z.
        lengths: those of height_m, base_m, radius_m, width_m, margin_m that it gives [m].
    """

    where: str
    name: str | None
    kind: str
    rings: tuple[FloatArray, ...]
    has_z: bool
    lengths: dict[str, float]


@dataclass(frozen=True, slots=True)
class Plan:
    """All shapes of a file, and sentences about it."""

    shapes: tuple[Shape, ...]
    notes: tuple[str, ...]


def read_plan(file: Path, origin: tuple[float, float] | None, *, metres: bool) -> Plan:
    """Read a GeoJSON file.

    Args:
        file: a Feature, FeatureCollection or bare geometry.
        origin: longitude, latitude [°] of the file's frame; None if coordinates are metres.
        metres: the caller says that they are.

    Raises:
        GeometryError: with file and feature, what is wrong with it.
        SettingsError: it cannot be read.
    """
    content = read_bytes(file, "GeoJSON file", limit=_MOST_BYTES)
    try:
        data = json.loads(content, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise GeometryError(f"{file}: is not valid JSON: {str(error)[:120]}") from None
    notes: list[str] = []
    shapes = tuple(_shapes(data, str(file), notes))
    if not shapes:
        raise GeometryError(f"{file}: holds no point, line or polygon")
    every = np.concatenate([ring for shape in shapes for ring in shape.rings])
    place = _place(data, every, str(file), origin, metres=metres, notes=notes)
    moved = tuple(
        Shape(s.where, s.name, s.kind, tuple(place(r) for r in s.rings), s.has_z, s.lengths)
        for s in shapes
    )
    for shape in moved:
        far = max(float(np.abs(ring).max()) for ring in shape.rings)
        if not far < _MOST_M:
            raise GeometryError(
                f"{shape.where}: {far:.4g} m from the origin; give the plan in local metres, near"
                " to the machine"
            )
    return Plan(moved, tuple(notes))


def _no_constant(word: str) -> float:
    raise ValueError(f"{word} is no number of JSON")


def _shapes(data: Any, file: str, notes: list[str]) -> Iterator[Shape]:
    if not isinstance(data, dict):
        raise GeometryError(f"{file}: holds {show(data)}, need a GeoJSON object")
    match data.get("type"):
        case "FeatureCollection":
            features = data.get("features")
            if not isinstance(features, list):
                raise GeometryError(f"{file}: 'features' is {show(features)}, need a list")
            for number, feature in enumerate(features):
                yield from _feature(feature, f"{file}: features[{number}]", notes)
        case "Feature":
            yield from _feature(data, file, notes)
        case _:
            yield from _geometry(data, file, None, {}, 0)


def _feature(feature: Any, where: str, notes: list[str]) -> Iterator[Shape]:
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        raise GeometryError(f"{where}: is {show(feature)}, need a Feature")
    properties = feature.get("properties") or {}
    if not isinstance(properties, dict):
        raise GeometryError(f"{where}: 'properties' is {show(properties)}, need an object")
    name = properties.get("name", feature.get("id"))
    if name is not None:
        name = str(name)
        where = f"{where} ({show(name)})"
    lengths = {}
    for key in (key for key in _LENGTHS if properties.get(key) is not None):
        value = properties[key]
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not abs(value) < _MOST_M
        ):
            raise GeometryError(f"{where}: {key} is {show(value)}, need a number of metres")
        if key != "base_m" and value < 0.0:
            raise GeometryError(f"{where}: {key} is {value:g}, need 0 or more")
        lengths[key] = float(value)
    unknown = [key for key in properties if key not in _KNOWN and key.split("_")[0] in _STEMS]
    if unknown:
        notes.append(f"{where}: {show(unknown[0])} is not used; known are {', '.join(_KNOWN)}")
    if feature.get("geometry") is None:
        notes.append(f"{where}: has no geometry: nothing to keep clear")
        return
    yield from _geometry(feature["geometry"], where, name, lengths, 0)


_STEMS: Final = {key.split("_")[0] for key in _KNOWN}


def _geometry(
    geometry: Any, where: str, name: str | None, lengths: dict[str, float], depth: int
) -> Iterator[Shape]:
    if not isinstance(geometry, dict) or depth > _DEEPEST:
        raise GeometryError(f"{where}: 'geometry' is {show(geometry)}, need a geometry")
    kind = geometry.get("type")
    if kind == "GeometryCollection":
        for part in _list(geometry.get("geometries"), where):
            yield from _geometry(part, where, name, lengths, depth + 1)
        return
    single = str(kind).removeprefix("Multi")
    if single not in {"Point", "LineString", "Polygon"}:
        raise GeometryError(f"{where}: geometry {show(kind)}; need points, lines or polygons")
    given = geometry.get("coordinates")
    for part in _list(given, where) if single != kind else [given]:
        match single:
            case "Point":
                rings: list[Any] = [[part]]
            case "LineString":
                rings = [part]
            case _:
                rings = _list(part, where)
        if not rings:
            raise GeometryError(f"{where}: a polygon without coordinates")
        found = [_ring(ring, where) for ring in rings]
        has_z = any(z for _, z in found)
        yield Shape(where, name, single, tuple(ring for ring, _ in found), has_z, lengths)


def _ring(ring: Any, where: str) -> tuple[FloatArray, bool]:
    """Coordinates (n, 3), and whether the file gives z."""
    rows, has_z = [], False
    for place in _list(ring, where):
        numbers = _list(place, where)[:3]
        if len(numbers) < 2 or not all(_is_number(v) for v in numbers):  # noqa: PLR2004 - x, y
            raise GeometryError(f"{where}: a position that is no two or three finite numbers")
        has_z |= len(numbers) == 3  # noqa: PLR2004
        rows.append([float(v) for v in (*numbers, 0.0)[:3]])
    if not rows:
        raise GeometryError(f"{where}: has no coordinates")
    return np.array(rows), has_z


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e12  # noqa: PLR2004 - no coordinate; NaN and what overflows fail, too


def _list(value: Any, where: str) -> list[Any]:
    if not isinstance(value, list):
        raise GeometryError(f"{where}: {show(value)} where a list of coordinates was due")
    return value


def _place(
    data: dict[str, Any],
    every: FloatArray,
    file: str,
    origin: tuple[float, float] | None,
    *,
    metres: bool,
    notes: list[str],
) -> Callable[[FloatArray], FloatArray]:
    """What takes coordinates of the file to metres."""
    crs = _crs(data)
    degrees = crs is not None and ("CRS84" in crs or crs.endswith(":4326"))
    fits = bool((np.abs(every[:, 0]) <= 180.0).all() and (np.abs(every[:, 1]) <= 90.0).all())  # noqa: PLR2004
    if origin is not None:
        if metres or not fits or (crs is not None and not degrees):
            raise GeometryError(f"{file}: its coordinates are no degrees; leave out --origin")
        notes.append(
            f"{file}: x is east and y north of longitude {origin[0]:.7f}, latitude"
            f" {origin[1]:.7f} (WGS 84), on the plane that touches the earth there"
        )
        return lambda ring: _local(ring, origin, file)
    if degrees or (fits and crs is None and not metres):
        because = f"its crs is {crs}" if degrees else "as GeoJSON has them, and nothing says else"
        also = "" if degrees else ", or --metres if it is in metres"
        raise GeometryError(
            f"{file}: its coordinates may be degrees of longitude and latitude ({because}); give"
            f" --origin LON LAT of the machine{also}"
        )
    return lambda ring: ring


def _crs(data: dict[str, Any]) -> str | None:
    """The name of the coordinate system, which GeoJSON knew until 2016 and many still write."""
    crs = data.get("crs")
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return name if isinstance(name, str) else None


def _local(ring: FloatArray, origin: tuple[float, float], file: str) -> FloatArray:
    """East and north [m] of longitudes and latitudes [°], on the plane touching at the origin."""
    lon, lat = np.radians(ring[:, 0]), np.radians(ring[:, 1])
    lon0, lat0 = (math.radians(v) for v in origin)
    offset = _earth(lon, lat) - _earth(np.array(lon0), np.array(lat0))
    east = -math.sin(lon0) * offset[..., 0] + math.cos(lon0) * offset[..., 1]
    out = math.cos(lon0) * offset[..., 0] + math.sin(lon0) * offset[..., 1]
    north = -math.sin(lat0) * out + math.cos(lat0) * offset[..., 2]
    far = float(np.hypot(east, north).max())
    if not far < ORIGIN_MOST_M:
        raise GeometryError(
            f"{file}: a point {far / 1000:.1f} km from --origin; more than"
            f" {ORIGIN_MOST_M / 1000:g} km are refused"
        )
    return np.column_stack([east, north, ring[:, 2]])


def _earth(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Where that is on the ellipsoid, from the middle of the earth (..., 3) [m]."""
    radius = _A / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    across = radius * np.cos(lat)
    return np.stack(
        [across * np.cos(lon), across * np.sin(lon), radius * (1.0 - _E2) * np.sin(lat)], axis=-1
    )
