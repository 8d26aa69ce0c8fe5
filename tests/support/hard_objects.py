"""Random keep-out objects of every kind: bulky, thin as a plate, thin as a wire."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SolidObject, Sphere
from tests.support.arms import box_triangles, write_stl

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.types import FloatArray, Point

BULKY = ("box", "sphere", "cylinder", "capsule", "notched", "hollow")
THIN = ("plate", "sheet", "wire", "rod", "bead", "pipe")


def random_object(
    rng: np.random.Generator, kind: str, name: str, at: FloatArray, reach: float, folder: Path
) -> SolidObject:
    """An object of a kind centred on ``at`` (3,), in size to the reach of an arm [m]."""
    turn = Rotation.random(random_state=rng).as_matrix()
    if rng.random() < 0.3:
        turn = np.eye(3)  # aligned faces and edges are cases of their own
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, at
    wide, long, tall = reach * rng.uniform(0.02, 0.15, size=3)
    fine = reach * 10.0 ** rng.uniform(-4.0, -3.0)
    ends = at - 0.5 * tall * turn[:, 2], at + 0.5 * tall * turn[:, 2]
    match kind:
        case "box":
            return Box(name=name, margin_m=0.0, size_m=_point(wide, long, tall), pose=pose)
        case "plate":
            return Box(name=name, margin_m=0.0, size_m=_point(fine, long, tall), pose=pose)
        case "sphere" | "bead":
            radius = 0.5 * wide if kind == "sphere" else 2.0 * fine
            return Sphere(name=name, margin_m=0.0, radius_m=radius, center_m=_point(*at))
        case "cylinder" | "rod":
            radius = 0.5 * wide if kind == "cylinder" else fine
            return Cylinder(name=name, margin_m=0.0, radius_m=radius, height_m=tall, pose=pose)
        case "capsule" | "wire":
            radius = 0.3 * wide if kind == "capsule" else fine
            a, b = _point(*ends[0]), _point(*ends[1])
            return Capsule(name=name, margin_m=0.0, radius_m=radius, start_m=a, end_m=b)
        case "sheet":
            file = _sheet(folder, fine / tall)
        case "notched":
            file = _notched(folder)
        case "hollow" | "pipe":
            file = _tube(folder, 0.6 if kind == "hollow" else 0.97)
        case _:
            raise NotImplementedError(kind)
    return Mesh(name=name, margin_m=0.0, file=file, scale=tall, pose=pose)


def random_plane(rng: np.random.Generator, name: str, reach: float) -> Halfspace:
    """Ground, wall or ceiling at the edge of the reach of an arm."""
    normal = rng.normal(size=3)
    if rng.random() < 0.5:
        normal = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    normal /= np.linalg.norm(normal)
    offset = -reach * float(rng.uniform(0.5, 1.1))
    return Halfspace(name=name, margin_m=0.0, normal=_point(*normal), offset_m=offset)


def shifted(item: SolidObject, way: FloatArray) -> SolidObject:
    """The same object moved by ``way`` (3,) [m]."""
    match item:
        case Sphere():
            return replace(item, center_m=_point(*(np.array(item.center_m) + way)))
        case Capsule():
            a, b = np.array(item.start_m) + way, np.array(item.end_m) + way
            return replace(item, start_m=_point(*a), end_m=_point(*b))
        case Halfspace():
            return replace(item, offset_m=item.offset_m + float(np.array(item.normal) @ way))
        case _:
            pose = item.pose.copy()
            pose[:3, 3] += way
            return replace(item, pose=pose)


def _point(x: float, y: float, z: float) -> Point:
    return float(x), float(y), float(z)


def _sheet(folder: Path, share: float) -> str:
    """A mesh 1 m long and wide, ``share`` of that thick (rounded up to a few files)."""
    thick = float(10.0 ** (np.ceil(2.0 * np.log10(share)) / 2.0))
    path = folder / f"sheet_{thick:.1e}.stl"
    if not path.exists():
        write_stl(path, box_triangles((thick, 1.0, 1.0), (0, 0, 0)))
    return str(path)


def _notched(folder: Path) -> str:
    """An L of two boxes that do not touch: not convex, and in two parts."""
    path = folder / "notched.stl"
    if not path.exists():
        low = box_triangles((1.0, 1.0, 0.3), (0, 0, -0.35))
        high = box_triangles((0.3, 1.0, 0.6), (-0.35, 0, 0.15))
        write_stl(path, np.concatenate([low, high]))
    return str(path)


def _tube(folder: Path, bore: float) -> str:
    """A closed tube 1 m long, ``bore`` of its 0.5 m width open: hollow, with thin walls."""
    path = folder / f"tube_{bore:.2f}.stl"
    if not path.exists():
        n = 24
        angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
        ring = 0.25 * np.column_stack([np.cos(angle), np.sin(angle)])
        rings = [(1.0, -0.5), (1.0, 0.5), (bore, 0.5), (bore, -0.5)]
        circles = [np.column_stack([r * ring, np.full(n, z)]) for r, z in rings]
        triangles = []
        for k in range(4):
            p, q = circles[k], circles[(k + 1) % 4]
            for i in range(n):
                j = (i + 1) % n
                triangles += [(p[i], p[j], q[j]), (p[i], q[j], q[i])]
        write_stl(path, np.array(triangles))
    return str(path)
