"""A straight way in actuator space: poses on a grid, and how far links can move in between.

For a piece of the path of length h (in path fraction) inside grid cell c, every point of link l

* moves at most ``rate[l, c]`` · h, and
* strays from the chord of its own way at most ``curvature[l, c]`` · h² / 8 + ``bend[l, c]`` · h,

where the first term is the turning of the joints (see kinematics) and the second the bending of
the drives: a joint whose slope lies in [m, M] strays from its chord by at most (M - m)·h/4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.kinematics import Chain, ForwardKinematics, JointMap, motion_coefficients

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.convex import IntArray
    from rampe_guard.core.types import FloatArray

LEVELS = 10
PROBE_MOTION_M = 0.002
"""Motion of the fastest link over the small first step that tells closing from opening [m]."""


class ArmMotion:
    """Where an arm's links are and how fast they can move, as functions of its actuators.

    Attributes:
        lower, upper: actuator values (n,) between which all drives are proven monotone.
        coefficients: R[j, l] of `motion_coefficients`.
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
        self._revolute = np.array(chain.revolute, dtype=float)
        self._ancestors = self._revolute[:, None] * chain.ancestors()
        span = upper - lower
        bounded = np.isfinite(span) & (span > 0.0)
        self._base = np.where(bounded, lower, 0.0)[self.actuator]
        self._span = np.where(bounded, span, 1.0)[self.actuator]
        self._slopes = self._slope_table()

    def joint_values(self, actuators: FloatArray) -> FloatArray:
        """θ (k, J) for actuator values (k, n)."""
        theta = np.empty((actuators.shape[0], len(self.joints)))
        for j, joint in enumerate(self.joints):
            theta[:, j] = joint.value(actuators[:, joint.actuator])
        return theta

    def link_poses(self, actuators: FloatArray) -> FloatArray:
        """World poses (k, L, 4, 4) of all links for actuator values (k, n)."""
        return self._kinematics.links(self.joint_values(actuators))

    def link_poses_at(self, actuators: FloatArray) -> FloatArray:
        """World poses (L, 4, 4) of all links for one set of actuator values (n,)."""
        q = actuators.tolist()
        theta = np.array([joint.scalar(q[joint.actuator]) for joint in self.joints])
        return self._kinematics.one(theta)

    def slopes(self, q_a: FloatArray, q_b: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds (k, J) of dθ/dq between actuator values (k, n), from dyadic tables."""
        a = (q_a[:, self.actuator] - self._base) / self._span
        b = (q_b[:, self.actuator] - self._base) / self._span
        low, width = np.minimum(a, b), np.abs(b - a)
        level = np.clip(-np.log2(np.maximum(width, 1e-12)), 0, LEVELS - 1).astype(np.intp)
        size = np.left_shift(1, level)
        index = np.clip(np.floor(low * size), 0, size - 1).astype(np.intp)
        beyond = np.minimum(index + 1, size - 1)
        joint = np.arange(len(self.joints))
        least, most = self._slopes
        return (
            np.minimum(least[joint, level, index], least[joint, level, beyond]),
            np.maximum(most[joint, level, index], most[joint, level, beyond]),
        )

    def bounds(
        self, q_a: FloatArray, q_b: FloatArray, displacement: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rate, curvature and bend (k, L) of a path of this displacement between q_a and q_b."""
        least, most = self.slopes(q_a, q_b)
        size = np.abs(displacement[self.actuator])
        speed = np.maximum(np.abs(least), np.abs(most)) * size
        turning = speed * (speed * self._revolute + 2.0 * (speed @ self._ancestors))
        R = self.coefficients
        return speed @ R, turning @ R, ((most - least) * size) @ R * 0.25

    def _slope_table(self) -> tuple[FloatArray, FloatArray]:
        shape = len(self.joints), LEVELS, 1 << (LEVELS - 1)
        least, most = np.empty(shape), np.empty(shape)
        for level in range(LEVELS):
            size = 1 << level
            edges = np.arange(size + 1) / size
            for j, joint in enumerate(self.joints):
                q = self._base[j] + edges * self._span[j]
                q[-1] = min(q[-1], float(self.upper[joint.actuator]))
                low, high = joint.slopes(q[:-1], q[1:])
                least[j, level, :size], most[j, level, :size] = low, high
        return least, most


def _range(joint: JointMap, lower: FloatArray, upper: FloatArray) -> tuple[float, float]:
    ends = joint.value(np.array([lower[joint.actuator], upper[joint.actuator]]))
    return float(ends.min()), float(ends.max())


@dataclass(frozen=True, slots=True)
class SweptPath:
    """Poses and motion bounds of one path, up to fraction ``end``, in K cells.

    Sample K + 1 is no grid point but the small first step ``probe``.

    Attributes:
        fractions: grid (K + 1,) from 0 to ``end``.
        rotations: of all links (3, L, K + 2, 3): element [i, l, k, j] is R_ij.
        translations: of all links (L, K + 2, 3) [m].
        rate, curvature, bend: per link and cell (L, K) [m], see the module.
        motion, stray: both bounds over a whole cell (L, K) [m].
    """

    arm: ArmMotion
    start: FloatArray
    displacement: FloatArray
    end: float
    fractions: FloatArray
    probe: float
    rotations: FloatArray
    translations: FloatArray
    rate: FloatArray
    curvature: FloatArray
    bend: FloatArray
    motion: FloatArray
    stray: FloatArray
    _poses: dict[float, FloatArray]

    @property
    def cells(self) -> int:
        """K."""
        return len(self.fractions) - 1

    def of_link(self, link: int) -> tuple[FloatArray, FloatArray]:
        """Rotations (K + 2, 3, 3) and translations (K + 2, 3) of a link at all samples."""
        return self.rotations[:, link].transpose(1, 0, 2), self.translations[link]

    def project(self, n: FloatArray, links: IntArray) -> tuple[FloatArray, FloatArray]:
        """A direction n in the frames of some links at all samples, and n·translation.

        Returns:
            (A, K + 2, 3) and (A, K + 2).
        """
        shape = self.rotations.shape[1:]
        local = (n @ self.rotations.reshape(3, -1)).reshape(shape)
        return local[links], (self.translations @ n)[links]

    def poses(self, fraction: float) -> FloatArray:
        """Poses (L, 4, 4) of all links at this fraction; remembered."""
        known = self._poses.get(fraction)
        if known is None:
            q = self.start + fraction * self.displacement
            q = np.minimum(np.maximum(q, self.arm.lower), self.arm.upper)
            known = self._poses[fraction] = self.arm.link_poses_at(q)
        return known


def valid_end(arm: ArmMotion, start: FloatArray, displacement: FloatArray) -> float | None:
    """Last fraction in [0, 1] where the drives are proven; None if not even the start is."""
    if not (np.isfinite(start).all() and np.isfinite(displacement).all()):
        return None
    if (start < arm.lower).any() or (start > arm.upper).any():
        return None
    end = 1.0
    for q, x, low, high in zip(start, displacement, arm.lower, arm.upper, strict=True):
        room = high - q if x > 0.0 else q - low
        if abs(x) > room:
            end = min(end, float(room / abs(x)))
    return end


def swept_path(
    arm: ArmMotion, start: FloatArray, displacement: FloatArray, end: float, stray_m: float
) -> SweptPath:
    """Sample a path so finely that links stray from their chords by about ``stray_m`` at most."""
    ends = start[None], (start + end * displacement)[None]
    rate, curvature, bend = arm.bounds(*ends, end * displacement)
    # Both terms shrink with the square of the cell length: bend's spread halves with the cell.
    stray = float((curvature / 8.0 + bend).max(initial=0.0))
    count = int(np.clip(np.ceil(np.sqrt(stray / stray_m)), 2, 32))
    fastest = float(rate.max(initial=0.0))
    if fastest == 0.0:
        count = 1
    fractions = np.linspace(0.0, end, count + 1)
    probe = end * min(1.0, PROBE_MOTION_M / fastest) if fastest > 0.0 else 0.0
    q = start + np.append(fractions, probe)[:, None] * displacement
    # start + 1·x may leave the proven range by a rounding error
    q = np.clip(q, arm.lower, arm.upper)
    poses = arm.link_poses(q)
    rate, curvature, bend = arm.bounds(q[:count], q[1 : count + 1], displacement)
    h = end / count
    return SweptPath(
        arm=arm,
        start=start,
        displacement=displacement,
        end=end,
        fractions=fractions,
        probe=probe,
        rotations=np.ascontiguousarray(poses[..., :3, :3].transpose(2, 1, 0, 3)),
        translations=np.ascontiguousarray(poses[..., :3, 3].transpose(1, 0, 2)),
        rate=rate.T,
        curvature=curvature.T,
        bend=bend.T,
        motion=rate.T * h,
        stray=curvature.T * (h * h / 8.0) + bend.T * h,
        _poses={float(s): pose for s, pose in zip(fractions, poses, strict=False)},
    )
