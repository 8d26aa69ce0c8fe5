"""The traps of FCL that the oracle steps round, re-measured on the installed release."""

from __future__ import annotations

import fcl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rampe_guard.collision.mesh import TriangleMesh, prism_mesh
from rampe_guard.collision.pieces import fcl_bvh, fcl_convex, hull, speck
from rampe_guard.core.convex import gaps


def _rigid(rng: np.random.Generator, spread: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    pose[:3, 3] = rng.normal(size=3) * spread
    return pose


def test_convex_distance_of_fcl_overestimates_and_the_certificate_does_not() -> None:
    """If the first assertion fails, FCL was mended; the certificate is needed while it holds."""
    rng = np.random.default_rng(0)
    points, faces = hull(rng.normal(size=(40, 3)) * [2, 0.4, 0.4])
    link = TriangleMesh(points, faces)
    prism = prism_mesh(1.0, 3.0, 222)
    convex = (
        fcl.CollisionObject(fcl_convex(points)),
        fcl.CollisionObject(fcl_convex(prism.vertices)),
    )
    exact = fcl.CollisionObject(fcl_bvh(link)), fcl.CollisionObject(fcl_bvh(prism))
    request = fcl.DistanceRequest(enable_nearest_points=True)
    overestimates = 0
    for _ in range(4000):
        pose = _rigid(rng, 2.0)
        convex[0].setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        result = fcl.DistanceResult()
        claimed = fcl.distance(*convex, request, result)
        p, q = result.nearest_points
        if not claimed > 1e-3:
            continue
        n = (q - p) / np.linalg.norm(q - p)
        low = float((prism.vertices @ n).min())
        proven = gaps(points.T, pose[None, :3, :3], pose[None, :3, 3], n, low)[0]
        if claimed - proven > 1e-4:
            exact[0].setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
            truth = fcl.distance(*exact, fcl.DistanceRequest())
            assert proven <= truth + 1e-6
            overestimates += claimed > truth + 1e-4
    assert overestimates > 0


def _point_to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.asarray(np.linalg.norm(points - (a + t[:, None] * (b - a)), axis=1))


def test_a_sliver_stands_for_a_segment() -> None:
    """BVH distance to the triangle of a capsule's core, against a fine grid of the other shape."""
    rng = np.random.default_rng(5)
    side = np.linspace(-0.5, 0.5, 161)
    grid = np.array([[x, y, 0.0] for x in side for y in side])
    square = TriangleMesh(
        np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    plate = fcl.CollisionObject(fcl_bvh(square))
    for _ in range(60):
        a, b = rng.normal(size=(2, 3)) + np.array([0, 0, 1.5])
        core = fcl.CollisionObject(fcl_bvh(speck(a, b)))
        found = fcl.distance(plate, core, fcl.DistanceRequest())
        truth = _point_to_segment(grid, a, b).min()
        assert found <= truth + 1e-6
        assert found >= truth - 0.005


@pytest.mark.parametrize("kind", ["box", "convex"])
def test_a_mesh_wholly_inside_a_box_or_convex_is_at_no_distance(kind: str) -> None:
    points, faces = hull(np.random.default_rng(2).normal(size=(30, 3)) * 0.1)
    small = fcl.CollisionObject(fcl_bvh(TriangleMesh(points, faces)))
    big = fcl.Box(5, 5, 5) if kind == "box" else fcl_convex(prism_mesh(3.0, 5.0).vertices)
    result = fcl.DistanceResult()
    fcl.distance(small, fcl.CollisionObject(big), fcl.DistanceRequest(), result)
    assert not result.min_distance > 1e-9
