from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from rampe_guard.collision import load_arm
from rampe_guard.core.kinematics import Chain, ForwardKinematics, motion_coefficients
from tests.support.arms import six_axis
from tests.support.dense import DenseArm

if TYPE_CHECKING:
    from pathlib import Path


def test_poses_agree_with_an_independent_walk_of_the_urdf(tmp_path: Path) -> None:
    description = six_axis(tmp_path)
    arm, other = load_arm(description), DenseArm(description)
    q = np.random.default_rng(3).uniform(-2, 2, size=(9, 6))
    kinematics = ForwardKinematics(arm.chain)
    theta = np.column_stack([joint.value(q[:, joint.actuator]) for joint in arm.joints])
    poses = kinematics.links(theta)
    expected = other.poses(q)
    for l, name in enumerate(arm.link_names):  # noqa: E741
        assert np.allclose(poses[:, l], expected[name], atol=1e-12)
    assert np.allclose(kinematics.one(theta[4]), poses[4], atol=1e-12)


def _straight(revolute: tuple[bool, ...]) -> Chain:
    """Joints in a row, one metre apart along x, axes z; links hang on each."""
    count = len(revolute)
    origin = np.tile(np.eye(4), (count, 1, 1))
    origin[1:, 0, 3] = 1.0
    return Chain(
        parent=tuple(range(count)),
        origin=origin,
        axis=np.tile([0.0, 0.0, 1.0], (count, 1)),
        revolute=revolute,
        link_frame=tuple(range(1, count + 1)),
        link_origin=np.tile(np.eye(4), (count, 1, 1)),
    )


def test_coefficients_of_a_planar_arm_are_its_full_reach() -> None:
    chain = _straight((True, True, True))
    rod = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    R = motion_coefficients(chain, [rod] * 3, [(-3.0, 3.0)] * 3)
    expected = [[1, 2, 3], [0, 1, 2], [0, 0, 1]]
    assert (np.array(expected) - 1e-12 <= R).all()
    assert (np.array(expected) * 1.01 >= R).all()


def test_a_slide_counts_once_and_lengthens_what_turns_before_it() -> None:
    chain = Chain(
        parent=(0, 1),
        origin=np.tile(np.eye(4), (2, 1, 1)),
        axis=np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
        revolute=(True, False),
        link_frame=(2,),
        link_origin=np.eye(4)[None],
    )
    R = motion_coefficients(chain, [np.zeros((1, 3))], [(-3.0, 3.0), (0.5, 2.0)])
    assert R[:, 0] == pytest.approx([2.0, 1.0], rel=0.01)
    assert R[0, 0] >= 2.0


def test_links_without_points_and_other_branches_do_not_count() -> None:
    chain = _straight((True, True))
    R = motion_coefficients(chain, [np.zeros((0, 3)), np.ones((1, 3))], [(0.0, 0.0)] * 2)
    assert (R[:, 0] == 0.0).all()
    assert chain.ancestors().tolist() == [[0.0, 1.0], [0.0, 0.0]]
