"""GeoJSON plans with heights → boxes, cylinders, capsules and closed prisms.

| geometry | with | becomes |
|---|---|---|
| Polygon | height_m | a prism from base_m up, a box if it is a rectangle; holes stay free |
| LineString | height_m, width_m | the same of a band of that width: a fence, a wall |
| LineString | radius_m, z in its coordinates or base_m | a capsule per stretch: a power line |
| Point | height_m, radius_m | an upright cylinder: a mast, a tree |
| Point | radius_m | a sphere |

Everything stands on base_m, else on the lowest z of its coordinates, else on 0.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from rampe_guard.collision.mesh import TriangleMesh
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError
from rampe_guard.scene_tools.draft import Common, Draft, DraftObject, Names, placed, plain
from rampe_guard.scene_tools.plan_read import Shape, read_plan
from rampe_guard.scene_tools.prism import band, polygon, prism, rectangle

_LEAST_M: Final = 1e-3


def import_plan(
    file: Path,
    names: Names,
    common: Common,
    *,
    prefix: str = "",
    origin: tuple[float, float] | None = None,
    metres: bool = False,
) -> Draft:
    """All shapes of a plan.

    Args:
        file: GeoJSON.
        names: of the scene.
        common: pose, margin, links.
        prefix: before the name of each object.
        origin: longitude, latitude [°] of the file's frame; None if coordinates are metres.
        metres: the caller says that they are.

    Raises:
        GeometryError: with file and feature, what is wrong with it.
        SettingsError: it cannot be read.
    """
    plan = read_plan(file, origin, metres=metres)
    maker = _Maker(names, common, prefix or f"{file.stem}-")
    for shape in plan.shapes:
        maker.add(shape, prefix)
    return Draft(tuple(maker.objects), plan.notes)


class _Maker:
    """Turns shapes into objects."""

    def __init__(self, names: Names, common: Common, unnamed: str) -> None:
        self._names, self._common, self._unnamed = names, common, unnamed
        self.objects: list[DraftObject] = []

    def add(self, shape: Shape, prefix: str) -> None:
        wanted = prefix + shape.name if shape.name else self._unnamed + shape.kind.lower()
        for fields, mesh in self._solids(shape):
            margin = self._common.fields(shape.lengths.get("margin_m"))
            name = self._names.new(wanted)
            self.objects.append(DraftObject(name, {**fields, **margin}, mesh))

    def _solids(self, shape: Shape) -> list[tuple[dict[str, Any], TriangleMesh | None]]:
        lengths = shape.lengths
        match shape.kind:
            case "Polygon":
                low, high = _heights(shape)
                outline = polygon(tuple(ring[:, :2] for ring in shape.rings), shape.where)
                return [self._prism(outline, low, high, shape.where)]
            case "LineString" if "radius_m" in lengths:
                return [(fields, None) for fields in self._capsules(shape)]
            case "LineString":
                low, high = _heights(shape)
                width = _given(shape, "width_m", "or radius_m for a pipe or power line")
                outline = band(shape.rings[0][:, :2], width, shape.where)
                return [self._prism(outline, low, high, shape.where)]
        return [(self._round(shape), None)]

    def _prism(
        self, outline: Any, low: float, high: float, where: str
    ) -> tuple[dict[str, Any], TriangleMesh | None]:
        box = rectangle(outline)
        if box is not None:
            pose = np.eye(4)
            pose[:2, :2] = [[np.cos(box.yaw), -np.sin(box.yaw)], [np.sin(box.yaw), np.cos(box.yaw)]]
            pose[:3, 3] = [*box.middle, 0.5 * (low + high)]
            size = [plain(v) for v in (*box.sides, high - low)]
            return {"type": "box", "size": size, "pose": placed(self._common.pose @ pose)}, None
        mesh = prism(outline, low, high, where)
        return {"type": "mesh", "pose": placed(self._common.pose)}, mesh

    def _capsules(self, shape: Shape) -> list[dict[str, Any]]:
        radius = _given(shape, "radius_m", "")
        line = shape.rings[0]
        if "base_m" in shape.lengths:
            line = line + np.array([0.0, 0.0, shape.lengths["base_m"]])
        elif not shape.has_z:
            raise GeometryError(
                f"{shape.where}: a line with radius_m hangs somewhere; give z in its coordinates,"
                " or base_m (for a wall: width_m and height_m)"
            )
        if "height_m" in shape.lengths:
            raise GeometryError(f"{shape.where}: height_m and radius_m; for a wall give width_m")
        if len(line) < 2:  # noqa: PLR2004
            raise GeometryError(f"{shape.where}: a line of one point; give a Point")
        points = line @ self._common.pose[:3, :3].T + self._common.pose[:3, 3]
        return [
            {"type": "capsule", "from": _list(a), "to": _list(b), "radius_m": plain(radius)}
            for a, b in pairwise(points)
        ]

    def _round(self, shape: Shape) -> dict[str, Any]:
        radius = plain(_given(shape, "radius_m", ""))
        pose = np.eye(4)
        pose[:3, 3] = shape.rings[0][0]
        if "height_m" not in shape.lengths:
            pose[2, 3] += shape.lengths.get("base_m", 0.0)
            center = _list((self._common.pose @ pose)[:3, 3])
            return {"type": "sphere", "radius_m": radius, "center": center}
        low, high = _heights(shape)
        pose[2, 3] = 0.5 * (low + high)
        sizes = {"radius_m": radius, "height_m": plain(high - low)}
        return {"type": "cylinder", **sizes, "pose": placed(self._common.pose @ pose)}


def _heights(shape: Shape) -> tuple[float, float]:
    """Lowest and highest z of an upright solid [m]."""
    z = np.concatenate([ring[:, 2] for ring in shape.rings])
    low = shape.lengths.get("base_m", float(z.min()))
    top = max(low, float(z.max())) if shape.has_z else low
    return low, top + _given(shape, "height_m", "")


def _given(shape: Shape, key: str, otherwise: str) -> float:
    """A length that is needed [m]."""
    value = shape.lengths.get(key)
    if value is None or value < _LEAST_M:
        what = "is missing" if value is None else f"is {value:g} m"
        raise GeometryError(
            f"{shape.where}: {key} of a {shape.kind} {what}; give it in its properties, at least"
            f" {_LEAST_M:g} {otherwise}".rstrip()
        )
    return value


def _list(point: FloatArray) -> list[float]:
    return [plain(v) for v in point]
