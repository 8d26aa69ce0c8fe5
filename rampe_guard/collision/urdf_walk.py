"""The tree of a URDF from its root: movable joints become the chain, all others constants."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.urdf_joints import MANY, TURNING
from rampe_guard.core.kinematics import Chain, ForwardKinematics
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.urdf_model import Joint, Link, Tree
    from rampe_guard.core.kinematics import JointMap
    from rampe_guard.core.types import FloatArray

_ONE = np.eye(4)[None]
_NAMED = 8
"""So many names stand in a message, then it says how many more."""


class Walk:
    """A tree walked once, parents first.

    Attributes:
        links: in the order of the walk.
        parents: index of the link above each, -1 for the root.
        joint_names: movable joints that something drives.

    Args:
        robot: the tree.
        maps: what drives each movable joint.
        held: where the others are held [rad or m].
        base: pose of the root in the world (4, 4) [m].
        path: what messages call it.

    Raises:
        GeometryError: it is no tree, or an origin or axis is no such.
    """

    def __init__(
        self,
        robot: Tree,
        maps: Mapping[str, JointMap],
        held: Mapping[str, float],
        base: FloatArray,
        path: Path,
    ) -> None:
        self.links: list[Link] = []
        self.parents: list[int] = []
        self.joint_names: list[str] = []
        self._maps, self._held, self._path = maps, held, path
        self._parent: list[int] = []
        self._origin: list[FloatArray] = []
        self._axis: list[FloatArray] = []
        self._revolute: list[bool] = []
        self._frame: list[int] = []
        self._pose: list[FloatArray] = []
        links = {link.name: link for link in robot.links}
        root, below = tree_of(robot, path)
        todo = [(root, -1, 0, np.asarray(base, dtype=float))]
        while todo:
            name, parent, frame, pose = todo.pop(0)
            here = len(self.links)
            self.links.append(links[name])
            self.parents.append(parent)
            self._frame.append(frame)
            self._pose.append(pose)
            todo += [
                (joint.child, here, *self._follow(joint, frame, pose)) for joint in below[name]
            ]

    def chain(self) -> Chain:
        """The kinematics found."""
        return Chain(
            parent=tuple(self._parent),
            origin=np.array(self._origin).reshape(-1, 4, 4),
            axis=np.array(self._axis).reshape(-1, 3),
            revolute=tuple(self._revolute),
            link_frame=tuple(self._frame),
            link_origin=np.array(self._pose),
        )

    def _follow(self, joint: Joint, frame: int, pose: FloatArray) -> tuple[int, FloatArray]:
        origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
        if not np.isfinite(origin).all():
            raise GeometryError(f"{self._path}: joint '{joint.name}' has an origin not finite")
        pose = pose @ origin
        if joint.type == "fixed" or joint.type in MANY:
            return frame, pose
        axis = np.array([1.0, 0.0, 0.0] if joint.axis is None else joint.axis, dtype=float)
        norm = float(np.linalg.norm(axis))
        if not (np.isfinite(norm) and norm > 0.0):
            raise GeometryError(f"{self._path}: joint '{joint.name}' has axis {axis.tolist()}")
        axis /= norm
        if joint.name not in self._maps:
            lone = Chain((0,), pose[None], axis[None], (joint.type in TURNING,), (1,), _ONE)
            held = np.array([[self._held[joint.name]]])
            return frame, ForwardKinematics(lone).links(held)[0, 0]
        self.joint_names.append(joint.name)
        self._parent.append(frame)
        self._origin.append(pose)
        self._axis.append(axis)
        self._revolute.append(joint.type in TURNING)
        return len(self._parent), np.eye(4)


def tree_of(robot: Tree, path: Path) -> tuple[str, dict[str, list[Joint]]]:
    """The root of a tree, and the joints below each link.

    Raises:
        GeometryError: it is no tree; names the links that make it none.
    """
    below: dict[str, list[Joint]] = {link.name: [] for link in robot.links}
    above: dict[str, Joint] = {}
    for joint in robot.joints:
        for end in (joint.parent, joint.child):
            if end not in below:
                raise GeometryError(f"{path}: joint '{joint.name}' names no link '{end}'")
        if joint.child in above:
            raise GeometryError(
                f"{path}: link '{joint.child}' has two parents: joints"
                f" '{above[joint.child].name}' and '{joint.name}'; a URDF is a tree, so cut closed"
                " chains open and let the cut joint follow (linkages of the site file)"
            )
        below[joint.parent].append(joint)
        above[joint.child] = joint
    roots = [name for name in below if name not in above]
    if len(roots) > 1:
        raise GeometryError(
            f"{path}: needs one root link, has {len(roots)}: {_names(roots)}; join them by fixed"
            " joints"
        )
    reached, todo = set(roots), list(roots)
    while todo:
        children = [joint.child for joint in below[todo.pop()]]
        reached.update(children)
        todo += children
    if len(reached) != len(below):
        lost = [name for name in below if name not in reached]
        raise GeometryError(f"{path}: links form a loop: {_names(lost)}")
    return roots[0], below


def _names(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(f"'{name}'" for name in names[:_NAMED]) + more
