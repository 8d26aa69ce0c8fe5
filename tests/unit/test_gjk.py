"""The lower bound of GJK against truths it cannot see: FCL's exact meshes, and closed forms."""

from __future__ import annotations

import fcl
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from rampe_guard.core.bounding_tree import BoundingTree, cylinder, single
from rampe_guard.core.gjk import distance
from rampe_guard.core.kernel_data import SCRATCH, Shapes, room, stack_trees
from rampe_guard.core.node_kernel import radius_of, shape_of
from rampe_guard.core.types import FloatArray

EYE = np.ascontiguousarray(np.eye(4)[:3])
POINTS = 40


def _bounds(
    a: BoundingTree, pose: FloatArray, b: BoundingTree, way: tuple[float, float, float]
) -> tuple[float, float]:
    shapes, (first, second) = stack_trees([a, b])
    scratch = room(SCRATCH, 1)[0]
    goal = (-np.inf, np.inf, 1e-7)
    rounding = radius_of(shapes, first) + radius_of(shapes, second)
    lower, upper = _distance(shapes, first, pose, second, way, goal, scratch.work)
    return lower - rounding, upper - rounding


def _distance(
    shapes: Shapes,
    first: int,
    pose: FloatArray,
    second: int,
    way: tuple[float, float, float],
    goal: tuple[float, float, float],
    work: FloatArray,
) -> tuple[float, float]:
    found = distance(
        shapes, shape_of(shapes, first), pose, shape_of(shapes, second), EYE, way, goal, work
    )
    return found[0], found[1]


def _pose(rng: np.random.Generator, spread: float) -> FloatArray:
    pose = np.empty((3, 4))
    pose[:, :3] = Rotation.random(random_state=rng).as_matrix()
    pose[:, 3] = rng.normal(size=3) * spread
    return pose


def _surface(points: FloatArray) -> fcl.CollisionObject:
    faces = ConvexHull(points).simplices
    model = fcl.BVHModel()
    model.beginModel(len(faces), len(points))
    model.addSubModel(points, faces)
    model.endModel()
    return fcl.CollisionObject(model)


def test_hulls_against_the_exact_meshes_of_fcl() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, POINTS, 3)) * [2.0, 0.4, 0.4]
    surfaces = _surface(a), _surface(b)
    apart = 0
    for _ in range(400):
        pose = _pose(rng, 2.0)
        surfaces[0].setTransform(fcl.Transform(pose[:, :3], pose[:, 3]))
        truth = fcl.distance(*surfaces, fcl.DistanceRequest())
        x, y, z = rng.normal(size=3)
        lower, upper = _bounds(single(a), pose, single(b), (x, y, z))
        assert lower <= upper + 1e-9
        if truth > 1e-6:
            apart += 1
            assert truth - 1e-6 <= upper <= truth + 1e-6
            assert truth - 2e-6 <= lower <= truth + 1e-6
        else:
            assert lower <= 1e-6
    assert apart > 100


@pytest.mark.parametrize("tilt", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.7])
def test_a_point_over_the_flat_end_of_a_cylinder(tilt: float) -> None:
    """Straight along the axis the rim has no direction of its own; rounding must not give one."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        side = np.cross(axis, rng.normal(size=3))
        side /= np.linalg.norm(side)
        center, radius, half = rng.normal(size=3) * 4.0, 0.72, 0.4
        height = float(rng.uniform(1e-5, 0.1))
        point = center + axis * (half + height) + side * (tilt * 0.5 * radius)
        pose = np.column_stack([np.eye(3), point])
        way = -axis + tilt * side
        lower, upper = _bounds(
            single(np.zeros((1, 3))),
            np.ascontiguousarray(pose),
            cylinder(center, half * axis, radius),
            (float(way[0]), float(way[1]), float(way[2])),
        )
        assert height - 1e-6 <= lower <= height + 1e-9
        assert height - 1e-9 <= upper <= height + 1e-6


def test_a_point_beside_a_cylinder_and_over_its_rim() -> None:
    rng = np.random.default_rng(4)
    for _ in range(300):
        pose = _pose(rng, 1.0)
        x, y, z = rng.uniform(-1.5, 1.5, 3)
        out = max(float(np.hypot(x, y)) - 0.5, 0.0)
        truth = float(np.hypot(out, max(abs(z) - 0.3, 0.0)))
        point = pose[:, :3] @ [x, y, z] + pose[:, 3]
        lower, upper = _bounds(
            single(np.zeros((1, 3))),
            np.ascontiguousarray(np.column_stack([np.eye(3), point])),
            cylinder(pose[:, 3], 0.3 * pose[:, 2], 0.5),
            (0.0, 0.0, 0.0),
        )
        assert lower <= truth + 1e-9
        assert upper >= truth - 1e-9
        assert truth == 0.0 or lower >= truth - 1e-4
