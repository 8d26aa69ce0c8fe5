"""An arm as a function of its actuators: where its links are, and how fast they can move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.kinematics import Chain, ForwardKinematics, JointMap, motion_coefficients

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.types import FloatArray

LEVELS = 10
PROBE_MOTION_M = 0.002
"""Motion of the fastest link over the small first step that tells closing from opening [m]."""


class ArmMotion:
    """Where an arm's links are and how fast they can move, as functions of its actuators.

    Attributes:
        lower, upper: actuator values (n,) between which all drives are proven monotone.
        coefficients: R[j, l] of `motion_coefficients`.
        base, span: of each joint's actuator range (J,), where it is bounded.
        slopes: bounds of dθ/dq over the dyadic intervals of that range, least and most, each
            (J, LEVELS, 2^(LEVELS - 1)): interval i of level k is base + span·[i, i + 1]/2^k.
    """

    def __init__(
        self,
        chain: Chain,
        joints: Sequence[JointMap],
        points: Sequence[FloatArray],
        lower: FloatArray,
        upper: FloatArray,
    ) -> None:
        self.chain = chain
        self.joints = tuple(joints)
        self.lower, self.upper = lower, upper
        self.actuator = np.array([joint.actuator for joint in joints], dtype=np.intp)
        self._kinematics = ForwardKinematics(chain)
        slides = [_range(joint, lower, upper) for joint in joints]
        self.coefficients = motion_coefficients(chain, points, slides)
        span = upper - lower
        bounded = np.isfinite(span) & (span > 0.0)
        self.base = np.where(bounded, lower, 0.0)[self.actuator]
        self.span = np.where(bounded, span, 1.0)[self.actuator]
        self.slopes = self._slope_table()

    def joint_values(self, actuators: FloatArray) -> FloatArray:
        """θ (k, J) for actuator values (k, n)."""
        theta = np.empty((actuators.shape[0], len(self.joints)))
        for j, joint in enumerate(self.joints):
            theta[:, j] = joint.value(actuators[:, joint.actuator])
        return theta

    def link_poses(self, actuators: FloatArray) -> FloatArray:
        """World poses (k, L, 4, 4) of all links for actuator values (k, n)."""
        return self._kinematics.links(self.joint_values(actuators))

    def common_frame(self, link: int, other: int) -> int:
        """The last frame that carries both links; 0 is the world."""
        carrying = {0}
        frame = self.chain.link_frame[other]
        while frame:
            carrying.add(frame)
            frame = self.chain.parent[frame - 1]
        frame = self.chain.link_frame[link]
        while frame not in carrying:
            frame = self.chain.parent[frame - 1]
        return frame

    def _slope_table(self) -> tuple[FloatArray, FloatArray]:
        shape = len(self.joints), LEVELS, 1 << (LEVELS - 1)
        least, most = np.empty(shape), np.empty(shape)
        for level in range(LEVELS):
            size = 1 << level
            edges = np.arange(size + 1) / size
            for j, joint in enumerate(self.joints):
                q = self.base[j] + edges * self.span[j]
                q[-1] = min(q[-1], float(self.upper[joint.actuator]))
                low, high = joint.slopes(q[:-1], q[1:])
                least[j, level, :size], most[j, level, :size] = low, high
        return least, most


def _range(joint: JointMap, lower: FloatArray, upper: FloatArray) -> tuple[float, float]:
    ends = joint.value(np.array([lower[joint.actuator], upper[joint.actuator]]))
    return float(ends.min()), float(ends.max())


def valid_end(arm: ArmMotion, start: FloatArray, displacement: FloatArray) -> float | None:
    """Last fraction in [0, 1] where the drives are proven; None if not even the start is."""
    if not (np.isfinite(start).all() and np.isfinite(displacement).all()):
        return None
    if (start < arm.lower).any() or (start > arm.upper).any():
        return None
    room = np.where(displacement > 0.0, arm.upper - start, start - arm.lower)
    way = np.abs(displacement)
    beyond = way > room
    return float((room[beyond] / way[beyond]).min()) if beyond.any() else 1.0
