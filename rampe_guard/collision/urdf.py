"""URDF and meshes to an `Arm`: links with checked meshes, joints driven by actuators."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rampe_guard.collision.mesh_places import mesh_file
from rampe_guard.collision.urdf_joints import (
    MANY,
    MovableJoint,
    actuator_limits,
    held_values,
    joint_maps,
    movable_joints,
    proven_limits,
)
from rampe_guard.collision.urdf_links import LinkReader
from rampe_guard.collision.urdf_tree import read_tree
from rampe_guard.collision.urdf_walk import Walk, tree_of
from rampe_guard.errors import GeometryError
from rampe_guard.folders import Folders

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.collision.mesh import TriangleMesh
    from rampe_guard.collision.urdf_model import Tree
    from rampe_guard.core.arm import ArmDescription
    from rampe_guard.core.kinematics import Chain, JointMap
    from rampe_guard.core.types import FloatArray

__all__ = ["Arm", "MovableJoint", "load_arm", "mesh_file", "movable_joints", "read_urdf"]


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm ready to be swept.

    Attributes:
        name: of the URDF.
        link_names: all links, parents first.
        parents: per link the index of the link above it, -1 for the root.
        meshes: per link, in its own frame [m]; None for a link without geometry.
        chain: kinematics of all links.
        joint_names: movable joints, in the chain's order.
        joints: what drives each of them.
        fixed_joints: joints that could move but that nobody drives, and where they are held.
        limits: per actuator (n, 2) [unit]; infinite for an endless turn.
        proven: per actuator (n, 2): where its drives are proven monotone; holds the limits.
        notes: sentences on what was mended or is remarkable in the meshes and joints.
    """

    name: str
    link_names: tuple[str, ...]
    parents: tuple[int, ...]
    meshes: tuple[TriangleMesh | None, ...]
    chain: Chain
    joint_names: tuple[str, ...]
    joints: tuple[JointMap, ...]
    fixed_joints: Mapping[str, float]
    limits: FloatArray
    proven: FloatArray
    notes: tuple[str, ...]


def load_arm(description: ArmDescription) -> Arm:
    """Read the URDF and meshes of a site's arm and check that its drives fit.

    Raises:
        GeometryError: naming the file, joint or mesh and the reason.
    """
    path = Path(description.urdf)
    robot = read_urdf(path)
    joints = {joint.name: joint for joint in robot.joints}
    maps = joint_maps(description, joints, path)
    limits = actuator_limits(description, joints, path)
    proven = proven_limits(limits, joints, maps, path)
    held = held_values(joints, maps, path)
    walk = Walk(robot, maps, held, description.base_pose, path)
    folders = None if description.folders is None else Folders(description.folders)
    reader = LinkReader(path, folders, description.package_dirs)
    meshes = tuple(reader.mesh(link) for link in walk.links)
    if all(mesh is None for mesh in meshes):
        raise GeometryError(f"{path}: no link has collision or visual geometry")
    stuck = tuple(
        f"{path}: joint '{name}' is {joint.type}: it is held where the URDF draws it; say where the"
        " arm stands by base_pose"
        for name, joint in joints.items()
        if joint.type in MANY
    )
    return Arm(
        name=robot.name,
        link_names=tuple(link.name for link in walk.links),
        parents=tuple(walk.parents),
        meshes=meshes,
        chain=walk.chain(),
        joint_names=tuple(walk.joint_names),
        joints=tuple(maps[name] for name in walk.joint_names),
        fixed_joints=held,
        limits=limits,
        proven=proven,
        notes=(*stuck, *(note for mesh in meshes if mesh is not None for note in mesh.notes)),
    )


def read_urdf(path: Path) -> Tree:
    """Links and joints as the file has them, meshes not looked for.

    For who writes a site file: `movable_joints` of it are those that actuators can drive, with
    their limits and top speeds, those nearer to the base first.

    Raises:
        GeometryError: there is no such file, or it is no URDF; names the line and what to do.
    """
    if not path.is_file():
        raise GeometryError(f"{path}: no such URDF file")
    try:
        tree = read_tree(path)
    except OSError as error:
        raise GeometryError(f"{path}: cannot be read: {error.strerror}") from error
    if not tree.links:
        raise GeometryError(f"{path}: no links")
    tree_of(tree, path)
    return tree
