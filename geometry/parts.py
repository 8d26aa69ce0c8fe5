"""Solids to build links from: plates cut from side views, pins, tubes, boxes; STL and URDF out.

Lengths in [m]; a side view is drawn in the x-z plane (z up) and given a width along y.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh
from manifold3d import CrossSection, Manifold, Mesh, OpType, set_circular_segments
from scipy.interpolate import CubicSpline

set_circular_segments(20)

FloatArray = npt.NDArray[np.float64]
XZ = tuple[float, float]
XYZ = tuple[float, float, float]
GRID_M = 1e-4
"""Vertices are merged at this distance, so that 32-bit STL keeps a solid closed."""


def box(lower: XYZ, upper: XYZ) -> Manifold:
    """Axis-aligned box between two corners."""
    size = np.subtract(upper, lower)
    return Manifold.cube(tuple(size)).translate(lower)


def plate(outline: list[XZ] | FloatArray, y_from: float, y_to: float) -> Manifold:
    """Side view ``outline`` (k, 2) of [x, z], counter-clockwise or not, between two y."""
    points = np.asarray(outline, dtype=float)
    x, z = points[:, 0], points[:, 1]
    if np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z) < 0:
        points = points[::-1]
    solid = Manifold.extrude(CrossSection([points]), y_to - y_from)
    return solid.rotate((90.0, 0.0, 0.0)).translate((0.0, y_to, 0.0))


def pin(at: XZ, radius: float, y_from: float, y_to: float) -> Manifold:
    """Round bar along y through ``at`` = (x, z)."""
    bar = Manifold.cylinder(y_to - y_from, radius).rotate((90.0, 0.0, 0.0))
    return bar.translate((at[0], y_to, at[1]))


def bar(x_from: float, x_to: float, radius: float) -> Manifold:
    """Round bar along x."""
    solid = Manifold.cylinder(x_to - x_from, radius)
    return solid.rotate((0.0, 90.0, 0.0)).translate((x_from, 0.0, 0.0))


def post(at: XYZ, radius: float, height: float) -> Manifold:
    """Round bar along z that stands on ``at``."""
    return Manifold.cylinder(height, radius).translate(at)


def union(*solids: Manifold) -> Manifold:
    """One solid of all that the arguments fill."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def both_sides(solid: Manifold) -> Manifold:
    """The solid and its mirror image across the x-z plane."""
    return union(solid, solid.mirror((0.0, 1.0, 0.0)))


def curve(knots: list[XZ], count: int) -> FloatArray:
    """Smooth curve (count, 2) through ``knots`` with increasing x (natural ends)."""
    points = np.asarray(knots, dtype=float)
    x = np.linspace(points[0, 0], points[-1, 0], count)
    return np.column_stack([x, CubicSpline(points[:, 0], points[:, 1], bc_type="natural")(x)])


def tidy(solid: Manifold) -> trimesh.Trimesh:
    """Triangle mesh of a solid without slivers below `GRID_M`."""
    mesh: Mesh = solid.set_tolerance(GRID_M).simplify(GRID_M).to_mesh()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def write_stl(solid: Manifold, path: Path) -> int:
    """Write a binary STL, read it back, and return its number of triangles.

    Raises:
        ValueError: if what was written is not one closed surface.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    tidy(solid).export(path, file_type="stl")
    written = trimesh.load_mesh(path)
    if not (written.is_watertight and written.is_winding_consistent and written.volume > 0):
        raise ValueError(f"{path}: the mesh is not closed")
    return len(written.faces)


@dataclass(frozen=True)
class Joint:
    """A URDF joint. ``kind`` is fixed, continuous, revolute or prismatic."""

    name: str
    kind: str
    parent: str
    child: str
    xyz: XYZ
    axis: XYZ = (0.0, -1.0, 0.0)
    limits: tuple[float, float] | None = None


def write_urdf(path: Path, robot: str, links: dict[str, Manifold], joints: list[Joint]) -> int:
    """Write ``path`` and one STL per link under ``meshes/`` beside it; return the triangles."""
    root = ET.Element("robot", name=robot)
    triangles = 0
    for name, solid in links.items():
        triangles += write_stl(solid, path.parent / "meshes" / f"{name}.stl")
        link = ET.SubElement(root, "link", name=name)
        for use in ("visual", "collision"):
            shape = ET.SubElement(ET.SubElement(link, use), "geometry")
            ET.SubElement(shape, "mesh", filename=f"meshes/{name}.stl")
    for joint in joints:
        element = ET.SubElement(root, "joint", name=joint.name, type=joint.kind)
        ET.SubElement(element, "parent", link=joint.parent)
        ET.SubElement(element, "child", link=joint.child)
        ET.SubElement(element, "origin", xyz=_numbers(joint.xyz), rpy="0 0 0")
        if joint.kind != "fixed":
            ET.SubElement(element, "axis", xyz=_numbers(joint.axis))
        if joint.limits is not None:
            lower, upper = (f"{value:.6f}" for value in joint.limits)
            ET.SubElement(element, "limit", lower=lower, upper=upper, effort="0", velocity="0")
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    path.write_text(f'<?xml version="1.0"?>\n{text}\n', encoding="utf-8")
    return triangles


def _numbers(values: XYZ) -> str:
    return " ".join(f"{value:.6f}".rstrip("0").rstrip(".") for value in values)
