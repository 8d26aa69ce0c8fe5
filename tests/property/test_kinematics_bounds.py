"""The two motion bounds, against dense random motions of random chains."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rampe_guard.core.arm_motion import ArmMotion
from rampe_guard.core.bounding_tree import single
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.drive import CylinderDrive, DirectDrive, Drive, FourBarDrive, TableDrive
from rampe_guard.core.kinematics import Chain, JointMap
from rampe_guard.core.sweep import Sweep
from rampe_guard.core.sweep_problem import SweepProblem, Zone
from rampe_guard.core.types import FloatArray

DRIVES: list[tuple[Drive, float, float]] = [
    (DirectDrive(), -2.0, 2.0),
    (DirectDrive(scale=-1.3, offset=0.2), -1.0, 1.0),
    (CylinderDrive(0.8, 2.3, 1.7, -1.0), 0.0, 1.2),
    (CylinderDrive(0.8, 2.3, 1.7, 0.5, -1, "base"), 0.0, 1.2),
    (TableDrive((0.0, 0.2, 1.0), (0.0, 1.0, 1.3)), 0.0, 1.0),
    (
        FourBarDrive(2.148921, 0.62, 1.66, 3.0974, 0.45, 0.62, 0.6, 0.46, direction=-1),
        0.0,
        0.96,
    ),
]


@st.composite
def motions(draw: st.DrawFn) -> tuple[ArmMotion, list[np.ndarray], np.ndarray, np.ndarray]:
    seed = draw(st.integers(0, 2**32 - 1))
    count = draw(st.integers(1, 4))
    kinds = [draw(st.integers(0, len(DRIVES) - 1)) for _ in range(count)]
    slides = [draw(st.booleans()) and kind < 2 for kind in kinds]
    rng = np.random.default_rng(seed)
    origin = np.tile(np.eye(4), (count, 1, 1))
    origin[:, :3, :3] = Rotation.random(count, random_state=rng).as_matrix()
    origin[:, :3, 3] = rng.normal(size=(count, 3))
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    parent = tuple(int(rng.integers(j + 1)) for j in range(count))
    chain = Chain(
        parent=parent,
        origin=origin,
        axis=axis,
        revolute=tuple(not slide for slide in slides),
        link_frame=tuple(range(1, count + 1)),
        link_origin=np.tile(np.eye(4), (count, 1, 1)),
    )
    points = [rng.normal(size=(6, 3)) for _ in range(count)]
    lower = np.array([DRIVES[kind][1] for kind in kinds])
    upper = np.array([DRIVES[kind][2] for kind in kinds])
    joints = [JointMap(i, DRIVES[kind][0]) for i, kind in enumerate(kinds)]
    arm = ArmMotion(chain, joints, points, lower, upper)
    start = rng.uniform(lower, upper)
    return arm, points, start, rng.uniform(lower, upper) - start


@given(motions())
@settings(max_examples=40, deadline=None)
def test_no_point_outruns_its_bounds(
    motion: tuple[ArmMotion, list[np.ndarray], np.ndarray, np.ndarray],
) -> None:
    arm, points, start, displacement = motion
    far = Zone("far", 0.0, single(np.full((1, 3), 1e3)))
    names = [str(link) for link in range(len(points))]
    problem = SweepProblem(arm, names, [single(cloud) for cloud in points], [far])
    Sweep(problem, SweepConfig()).run(start, displacement, clearance=False)
    cells = int(problem.scratch.cells)
    for cell in range(cells):
        a, b = cell / cells, (cell + 1) / cells
        s = np.linspace(a, b, 12)
        poses = arm.link_poses(start + s[:, None] * displacement)
        for mover, link in enumerate(problem.pairs.mover.link):
            cloud = points[link]
            rate, curvature, bend = problem.path.bounds[mover, cell]
            ways = np.einsum("kij,vj->kvi", poses[:, link, :3, :3], cloud)
            ways += poses[:, None, link, :3, 3]
            assert np.allclose(
                ways[0], _posed(problem, cell, link, cloud), atol=1e-9
            )  # the kernel's kinematics are those of numpy
            for i in range(len(s)):
                moved = np.linalg.norm(ways - ways[i], axis=2).max(axis=1)
                assert (moved <= rate * np.abs(s - s[i]) + 1e-9).all()
            share = ((s - a) / (b - a))[:, None, None]
            chord = (1.0 - share) * ways[0] + share * ways[-1]
            stray = np.linalg.norm(ways - chord, axis=2).max()
            h = b - a
            assert stray <= curvature * h * h / 8.0 + bend * h + 1e-9


def _posed(problem: SweepProblem, cell: int, link: int, cloud: FloatArray) -> FloatArray:
    frame = problem.path.frames[cell, problem.arm.chain.link_frame[link]]
    whole = np.vstack([frame, [0.0, 0.0, 0.0, 1.0]]) @ problem.arm.chain.link_origin[link]
    return np.asarray(cloud @ whole[:3, :3].T + whole[:3, 3])
