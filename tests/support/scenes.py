"""Random scenes and motions for the comparison of the sweep with dense sampling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from rampe_guard.core.scene import Box, Capsule, Cylinder, Mesh, SolidObject, Sphere
from tests.support.arms import box_triangles, write_stl

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.types import FloatArray, Point


def pose(xyz: FloatArray | Point, rotation: FloatArray | None = None) -> FloatArray:
    """Homogeneous matrix."""
    matrix = np.eye(4)
    matrix[:3, 3] = xyz
    if rotation is not None:
        matrix[:3, :3] = rotation
    return matrix


def _point(values: FloatArray) -> Point:
    x, y, z = (float(v) for v in values)
    return x, y, z


def notched_block(folder: Path, size: float) -> str:
    """A mesh that is not convex: an L of two boxes."""
    low = box_triangles((size, size, 0.3 * size), (0, 0, -0.35 * size))
    high = box_triangles((0.3 * size, size, size), (-0.35 * size, 0, 0.3 * size))
    path = folder / "notched.stl"
    if not path.exists():
        write_stl(path, np.concatenate([low, high]))
    return str(path)


def random_scene(
    rng: np.random.Generator, folder: Path, reach: float, count: int = 5
) -> list[SolidObject]:
    """Boxes, spheres, cylinders, capsules and meshes within reach, some in the way."""
    items: list[SolidObject] = []
    for i in range(count):
        way = rng.normal(size=3)
        way[2] = abs(way[2]) * 0.7
        place = way / np.linalg.norm(way) * reach * rng.uniform(0.5, 1.0)
        turn = np.eye(3) if rng.random() < 0.3 else Rotation.random(random_state=rng).as_matrix()
        size = reach * rng.uniform(0.03, 0.25, size=3)
        name = f"zone-{i}"
        kind = rng.integers(5)
        if kind == 0:
            items.append(Box(name=name, margin_m=0.0, size_m=_point(size), pose=pose(place, turn)))
        elif kind == 1:
            items.append(
                Sphere(name=name, margin_m=0.0, radius_m=float(size[0]), center_m=_point(place))
            )
        elif kind == 2:
            items.append(
                Cylinder(
                    name=name,
                    margin_m=0.0,
                    radius_m=float(size[0]),
                    height_m=float(3 * size[1]),
                    pose=pose(place, turn),
                )
            )
        elif kind == 3:
            other = place + 3 * size * rng.choice([-1.0, 1.0], size=3)
            items.append(
                Capsule(
                    name=name,
                    margin_m=0.0,
                    radius_m=float(0.3 * size[0]),
                    start_m=_point(place),
                    end_m=_point(other),
                )
            )
        else:
            items.append(
                Mesh(
                    name=name,
                    margin_m=0.0,
                    file=notched_block(folder, 1.0),
                    scale=float(size.max()),
                    pose=pose(place, turn),
                )
            )
    return items


def random_motion(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, share: float
) -> tuple[FloatArray, FloatArray]:
    """Start within the limits and a displacement of up to ``share`` of each range."""
    start = rng.uniform(lower, upper)
    moved = rng.uniform(-share, share, size=len(start)) * (upper - lower)
    end = np.clip(start + moved, lower, upper)
    return start, end - start
