"""What importers make holds all that they read: every point of a cloud, every place of a plan."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.scene_tools.cloud import CloudWishes, import_cloud
from rampe_guard.scene_tools.draft import Common, Names
from rampe_guard.scene_tools.prism import polygon, prism
from rampe_guard.scene_tools.voxels import boxes, gather
from tests.support.depth import depth

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=depth(25, 500), deadline=None, derandomize=True)
@given(seeds, st.floats(0.01, 1.0), st.integers(2, 60))
def test_every_point_of_a_cloud_is_in_a_box(seed: int, voxel_m: float, most: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, rng.uniform(0.01, 3.0, 3), (200, 3)) + rng.uniform(-50, 50, 3)
    points[::3] = np.round(points[::3] / voxel_m) * voxel_m  # on the faces of voxels
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "c.xyz"
        np.savetxt(file, points, fmt="%.17g")
        draft = import_cloud(file, Names(), Common(), CloudWishes(voxel_m=voxel_m, most=most))
    assert len(draft.objects) <= most
    low = np.array([np.subtract(o.fields["pose"]["xyz"], np.array(o.fields["size"]) / 2)
                    for o in draft.objects])  # fmt: skip
    high = low + np.array([o.fields["size"] for o in draft.objects])
    inside = (points[:, None] >= low) & (points[:, None] <= high)
    assert inside.all(axis=2).any(axis=1).all()


@settings(max_examples=depth(25, 500), deadline=None, derandomize=True)
@given(seeds)
def test_boxes_hold_each_voxel_once_and_no_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.asarray(rng.integers(-4, 4, (rng.integers(1, 300), 3)) + 0.5, float)
    voxels = gather([points], 1.0)
    held = [
        (x, y, z)
        for low, high in boxes(voxels).tolist()
        for x in range(low[0], high[0])
        for y in range(low[1], high[1])
        for z in range(low[2], high[2])
    ]
    assert sorted(held) == sorted(map(tuple, voxels.index.tolist()))


@settings(max_examples=depth(15, 300), deadline=None, derandomize=True)
@given(seeds)
def test_a_prism_holds_its_outline_and_leaves_its_hole_free(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(8, 40)))
    angle = np.append(angle, [0.0, 2.0, 4.0])
    angle.sort()
    star = (
        np.column_stack([np.cos(angle), np.sin(angle)]) * rng.uniform(1.0, 3.0, len(angle))[:, None]
    )
    hole = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
    drawn = shapely.Polygon(star, [hole])
    if not drawn.is_valid:
        return
    mesh = prism(polygon((star, hole), "x"), 1.0, 2.0, "x")
    assert mesh.is_watertight()
    points = rng.uniform(-3.0, 3.0, (150, 2))
    inside = shapely.contains_xy(drawn, points[:, 0], points[:, 1])
    near = shapely.contains_xy(drawn.buffer(0.05), points[:, 0], points[:, 1])
    held = np.abs(mesh.winding(np.column_stack([points, np.full(150, 1.5)]))) > 0.5
    assert held[inside].all()
    assert not held[~near].any()
