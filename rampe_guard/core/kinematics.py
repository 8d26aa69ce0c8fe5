"""Forward kinematics of a tree of links, and how far any point can move when joints move.

Two proven bounds carry the sweep. With R the coefficients of `motion_coefficients`:

* first order: no point of link l moves more than Σ_j |Δθ_j| R[j, l];
* second order: while the joints go straight from θ to θ + Δθ, no point of link l strays
  from the chord of its own way by more than Σ_j R[j, l] |Δθ_j| w_j / 8, where
  w_j = |Δθ_j| (revolute j) + 2 Σ |Δθ_i| over revolute ancestors i of j. This is max |x''| / 8
  with |∂²x/∂θ_i∂θ_j| <= |∂x/∂θ_j| <= R[j, l] for i an ancestor of j.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.drive import Drive, joint_scalar, joint_value
from rampe_guard.core.drive_proof import slope_bounds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.types import FloatArray

RIM_POINTS = 64
"""Corners of the polygon that stands for a circle; its excess is 1/cos(π/64) - 1 = 0.12 %."""


@dataclass(frozen=True, slots=True)
class Chain:
    """A tree of links joined by movable joints; fixed joints are folded into the constants.

    Frame 0 is the world; frame j + 1 turns or slides with joint j. Parents come first.

    Attributes:
        parent: frame that joint j is mounted on (J,), 0 = the world.
        origin: pose of joint j at zero in its parent frame (J, 4, 4) [m].
        axis: unit axis in the joint's own frame (J, 3).
        revolute: turns (True) or slides (False) (J,).
        link_frame: frame that carries link l (L,).
        link_origin: pose of link l in that frame (L, 4, 4) [m].
    """

    parent: tuple[int, ...]
    origin: FloatArray
    axis: FloatArray
    revolute: tuple[bool, ...]
    link_frame: tuple[int, ...]
    link_origin: FloatArray

    @property
    def joints(self) -> int:
        """Number of movable joints J."""
        return len(self.parent)

    @property
    def links(self) -> int:
        """Number of links L."""
        return len(self.link_frame)

    def ancestors(self) -> FloatArray:
        """A[i, j] = 1 where joint i comes before joint j on its way from the world (J, J)."""
        matrix = np.zeros((self.joints, self.joints))
        for j, frame in enumerate(self.parent):
            if frame:
                matrix[:, j] = matrix[:, frame - 1]
                matrix[frame - 1, j] = 1.0
        return matrix


class ForwardKinematics:
    """Batched poses of a chain's links, with the constants of Rodrigues' formula ready.

    The pose of joint j in its parent is O + sin θ · O K + (1 - cos θ) · O K² when it turns
    and O + θ · O k when it slides.
    """

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        count = chain.joints
        self._first = np.zeros((count, 4, 4))
        self._second = np.zeros((count, 4, 4))
        self._turns = np.array(chain.revolute, dtype=bool)[:, None, None]
        for j in range(count):
            if chain.revolute[j]:
                cross = np.zeros((4, 4))
                cross[:3, :3] = skew(chain.axis[j])
                self._first[j] = chain.origin[j] @ cross
                self._second[j] = chain.origin[j] @ cross @ cross
            else:
                slide = np.zeros((4, 4))
                slide[:3, 3] = chain.axis[j]
                self._first[j] = chain.origin[j] @ slide
        self._frames = np.array(chain.link_frame, dtype=np.intp)

    def frames(self, joints: FloatArray) -> FloatArray:
        """Poses of all frames, the world first.

        Args:
            joints: θ (k, J) [rad] or [m].

        Returns:
            (k, J + 1, 4, 4).
        """
        theta = np.asarray(joints, dtype=float)[:, :, None, None]
        first = np.where(self._turns, np.sin(theta), theta)
        second = np.where(self._turns, 1.0 - np.cos(theta), 0.0)
        local = self.chain.origin + first * self._first + second * self._second
        poses = np.empty((theta.shape[0], self.chain.joints + 1, 4, 4))
        poses[:, 0] = np.eye(4)
        for j, frame in enumerate(self.chain.parent):
            poses[:, j + 1] = poses[:, frame] @ local[:, j] if frame else local[:, j]
        return poses

    def one(self, joints: FloatArray) -> FloatArray:
        """Poses of all links (L, 4, 4) for a single θ (J,); `links` without the batch's cost."""
        theta = joints[:, None, None]
        first = np.where(self._turns, np.sin(theta), theta)
        second = np.where(self._turns, 1.0 - np.cos(theta), 0.0)
        local = self.chain.origin + first * self._first + second * self._second
        poses = np.empty((self.chain.joints + 1, 4, 4))
        poses[0] = np.eye(4)
        for j, frame in enumerate(self.chain.parent):
            np.dot(poses[frame], local[j], out=poses[j + 1])
        return np.asarray(poses[self._frames] @ self.chain.link_origin)

    def links(self, joints: FloatArray) -> FloatArray:
        """Poses of all links in the world (k, L, 4, 4) for θ (k, J)."""
        return np.asarray(self.frames(joints)[:, self._frames] @ self.chain.link_origin)


@dataclass(frozen=True, slots=True)
class JointMap:
    """Joint j = multiplier · drive(q[actuator]) + offset; the factor serves mimic joints."""

    actuator: int
    drive: Drive
    multiplier: float = 1.0
    offset: float = 0.0

    def value(self, actuator: FloatArray) -> FloatArray:
        """θ for an array of values of this actuator."""
        return self.multiplier * joint_value(self.drive, actuator) + self.offset

    def scalar(self, q: float) -> float:
        """θ for one value of this actuator."""
        return self.multiplier * joint_scalar(self.drive, q) + self.offset

    def slopes(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds of dθ/dq over each interval."""
        lo, hi = slope_bounds(self.drive, lower, upper)
        a, b = self.multiplier * lo, self.multiplier * hi
        return np.minimum(a, b), np.maximum(a, b)


def motion_coefficients(
    chain: Chain, points: Sequence[FloatArray], slides: Sequence[tuple[float, float]]
) -> FloatArray:
    """R[j, l]: no point of link l moves more than R[j, l] per unit of joint j (J, L).

    From the link towards the world, the set that its points can reach is boxed into the
    cylinder they sweep about each joint axis; its two rims, as polygons that contain them,
    stand for it at the next joint. Distance from an axis is convex, so corners suffice.

    Args:
        chain: the tree.
        points: per link, points (n, 3) [m] in the link's frame whose hull contains the link;
            empty for a link without geometry.
        slides: per joint, least and greatest θ; used for sliding joints only.

    Returns:
        [m/rad] for revolute joints, 1 [m/m] for sliding ones that carry the link, else 0.
    """
    R = np.zeros((chain.joints, chain.links))
    for link, frame in enumerate(chain.link_frame):
        reach = np.asarray(points[link], dtype=float)
        if reach.size == 0:
            continue
        reach = apply(chain.link_origin[link], reach)
        joint = frame - 1
        while joint >= 0:
            axis = chain.axis[joint]
            if chain.revolute[joint]:
                R[joint, link], reach = _turned(reach, axis)
            else:
                R[joint, link] = 1.0
                lower, upper = slides[joint]
                reach = np.concatenate([reach + lower * axis, reach + upper * axis])
            reach = apply(chain.origin[joint], reach)
            joint = chain.parent[joint] - 1
    return R


def apply(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) taken by a pose (4, 4)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def skew(axis: FloatArray) -> FloatArray:
    """Matrix K with K v = axis x v."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _turned(points: FloatArray, axis: FloatArray) -> tuple[float, FloatArray]:
    """Largest distance from the axis, and corners (2·RIM_POINTS, 3) whose hull holds every turn."""
    along = points @ axis
    radius = float(np.linalg.norm(points - along[:, None] * axis, axis=1).max())
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    angle = np.arange(RIM_POINTS) * (2.0 * np.pi / RIM_POINTS)
    rim = np.outer(np.cos(angle), side) + np.outer(np.sin(angle), np.cross(axis, side))
    rim *= radius / np.cos(np.pi / RIM_POINTS)
    return radius, np.concatenate([rim + along.min() * axis, rim + along.max() * axis])
