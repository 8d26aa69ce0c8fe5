"""URDF and meshes to an `Arm`: links with checked meshes, joints driven by actuators."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rampe_guard.collision.mesh import (
    LINK_MOST_M,
    TriangleMesh,
    ball_mesh,
    box_mesh,
    check_extent,
    checked_mesh,
    load_mesh,
    open_words,
    prism_mesh,
)
from rampe_guard.collision.urdf_tree import Tree, read_tree
from rampe_guard.core.drive import actuator_value, domain
from rampe_guard.core.drive_proof import check_monotone
from rampe_guard.core.kinematics import Chain, ForwardKinematics, JointMap
from rampe_guard.errors import GeometryError
from rampe_guard.folders import Folders

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rampe_guard.core.arm import ArmDescription, JointDrive
    from rampe_guard.core.types import FloatArray

SLACKS = (0.1, 0.05, 0.02, 0.0)
"""Shares of its range by which a path may overrun an actuator's limits, the first that works."""
TURNING = ("revolute", "continuous")
MOVABLE = (*TURNING, "prismatic")
_ONE = np.eye(4)[None]


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
        notes: sentences on what was mended or is remarkable in the meshes.
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
    joints: dict[str, Any] = {joint.name: joint for joint in robot.joints}
    maps = _joint_maps(description, joints, path)
    limits = _limits(description, joints, path)
    proven = _proven(limits, joints, maps, path)
    walk = _Walk(robot, maps, description.base_pose, path)
    folders = None if description.folders is None else Folders(description.folders)
    meshes = tuple(_link_mesh(link, path, folders) for link in walk.links)
    if all(mesh is None for mesh in meshes):
        raise GeometryError(f"{path}: no link has collision or visual geometry")
    return Arm(
        name=str(robot.name),
        link_names=tuple(link.name for link in walk.links),
        parents=tuple(walk.parents),
        meshes=meshes,
        chain=walk.chain(),
        joint_names=tuple(walk.joint_names),
        joints=tuple(maps[name] for name in walk.joint_names),
        fixed_joints=walk.fixed,
        limits=limits,
        proven=proven,
        notes=tuple(note for mesh in meshes if mesh is not None for note in mesh.notes),
    )


def read_urdf(path: Path) -> Tree:
    """Links and joints as the file has them.

    Raises:
        GeometryError: there is no such file, or it is no URDF.
    """
    if not path.is_file():
        raise GeometryError(f"{path}: no such URDF file")
    try:
        tree = read_tree(path)
    except GeometryError:
        raise
    except Exception as error:  # the reader raises whatever it likes
        raise GeometryError(f"{path}: cannot be read as a URDF: {error}") from error
    if not tree.links:
        raise GeometryError(f"{path}: no links")
    return tree


def _joint_maps(
    description: ArmDescription, joints: dict[str, Any], path: Path
) -> dict[str, JointMap]:
    maps: dict[str, JointMap] = {}
    for entry in description.joints:
        joint = joints.get(entry.joint)
        if joint is None:
            known = ", ".join(name for name, j in joints.items() if j.type in MOVABLE)
            raise GeometryError(f"{path}: no joint '{entry.joint}'; it has {known or 'none'}")
        if joint.type not in MOVABLE:
            raise GeometryError(f"{path}: joint '{entry.joint}' is {joint.type}, nothing to drive")
        if entry.joint in maps:
            raise GeometryError(f"{path}: joint '{entry.joint}' is driven twice")
        maps[entry.joint] = JointMap(entry.actuator, entry.drive)
    for name, joint in joints.items():
        if name in maps or joint.mimic is None or joint.mimic.joint not in maps:
            continue
        source = maps[joint.mimic.joint]
        factor = 1.0 if joint.mimic.multiplier is None else float(joint.mimic.multiplier)
        offset = 0.0 if joint.mimic.offset is None else float(joint.mimic.offset)
        maps[name] = JointMap(source.actuator, source.drive, factor, offset)
    return maps


def _limits(description: ArmDescription, joints: dict[str, Any], path: Path) -> FloatArray:
    limits = np.empty((len(description.limits), 2))
    for i, given in enumerate(description.limits):
        entry = description.joints[i]
        lower, upper = given
        if lower is None or upper is None:
            ends = _urdf_limits(entry, joints[entry.joint], path)
            lower = ends[0] if lower is None else lower
            upper = ends[1] if upper is None else upper
        if not lower < upper:
            raise GeometryError(
                f"{path}: actuator of joint '{entry.joint}' has limits {lower:.6g} to {upper:.6g}"
            )
        limits[i] = lower, upper
    return limits


def _urdf_limits(entry: JointDrive, joint: Any, path: Path) -> tuple[float, float]:
    lower = None if joint.limit is None else joint.limit.lower
    upper = None if joint.limit is None else joint.limit.upper
    if joint.type == "continuous" or lower is None or upper is None:
        return -np.inf, np.inf
    try:
        ends = [actuator_value(entry.drive, float(value)) for value in (lower, upper)]
    except GeometryError as error:
        raise GeometryError(f"{path}: limits of joint '{entry.joint}': {error}") from error
    return min(ends), max(ends)


def _proven(
    limits: FloatArray, joints: dict[str, Any], maps: dict[str, JointMap], path: Path
) -> FloatArray:
    """Widen each actuator's limits by as much slack as all its drives are proven for."""
    proven = limits.copy()
    for i, (lower, upper) in enumerate(limits):
        mine = {name: joint for name, joint in maps.items() if joint.actuator == i}
        for slack in SLACKS:
            wide = slack * (upper - lower) if np.isfinite(upper - lower) else 0.0
            low, high = lower - wide, upper + wide
            for joint in mine.values():
                least, most = domain(joint.drive)
                if slack:
                    low, high = max(low, least), min(high, most)
            try:
                for name, joint in mine.items():
                    _check_joint(name, joint, joints[name].type, (low, high))
            except GeometryError as error:
                if slack == SLACKS[-1]:
                    raise GeometryError(f"{path}: {error}") from error
                continue
            proven[i] = min(low, lower), max(high, upper)
            break
    return proven


def _check_joint(name: str, joint: JointMap, kind: str, ends: tuple[float, float]) -> None:
    if kind == "prismatic" and not np.isfinite(ends).all():
        raise GeometryError(f"joint '{name}' slides without limits; give limits of its actuator")
    if not np.isfinite([joint.multiplier, joint.offset]).all():
        raise GeometryError(f"joint '{name}': mimic multiplier and offset must be finite")
    try:
        check_monotone(joint.drive, *ends)
    except GeometryError as error:
        raise GeometryError(f"joint '{name}': {error}") from error


class _Walk:
    """The tree from its root: movable joints become the chain, all others constants."""

    def __init__(
        self, robot: Tree, maps: dict[str, JointMap], base: FloatArray, path: Path
    ) -> None:
        self.links: list[Any] = []
        self.parents: list[int] = []
        self.joint_names: list[str] = []
        self.fixed: dict[str, float] = {}
        self._parent: list[int] = []
        self._origin: list[FloatArray] = []
        self._axis: list[FloatArray] = []
        self._revolute: list[bool] = []
        self._frame: list[int] = []
        self._pose: list[FloatArray] = []
        links = {link.name: link for link in robot.links}
        below: dict[str, list[Any]] = {name: [] for name in links}
        children: set[str] = set()
        for joint in robot.joints:
            for end in (joint.parent, joint.child):
                if end not in links:
                    raise GeometryError(f"{path}: joint '{joint.name}' names no link '{end}'")
            if joint.child in children:
                raise GeometryError(f"{path}: link '{joint.child}' has two parents")
            below[joint.parent].append(joint)
            children.add(joint.child)
        roots = [name for name in links if name not in children]
        if len(roots) != 1:
            raise GeometryError(f"{path}: needs one root link, has {roots or 'a loop'}")
        todo = [(roots[0], -1, 0, np.asarray(base, dtype=float))]
        while todo:
            name, parent, frame, pose = todo.pop(0)
            here = len(self.links)
            self.links.append(links[name])
            self.parents.append(parent)
            self._frame.append(frame)
            self._pose.append(pose)
            todo += [
                (joint.child, here, *self._follow(joint, frame, pose, maps, path))
                for joint in below[name]
            ]
        if len(self.links) != len(links):
            raise GeometryError(f"{path}: its links form a loop")

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

    def _follow(
        self, joint: Any, frame: int, pose: FloatArray, maps: dict[str, JointMap], path: Path
    ) -> tuple[int, FloatArray]:
        origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
        if not np.isfinite(origin).all():
            raise GeometryError(f"{path}: joint '{joint.name}' has an origin that is not finite")
        pose = pose @ origin
        if joint.type not in MOVABLE:
            if joint.type != "fixed":
                self.fixed[joint.name] = 0.0
            return frame, pose
        axis = np.array([1.0, 0.0, 0.0] if joint.axis is None else joint.axis, dtype=float)
        norm = float(np.linalg.norm(axis))
        if not (np.isfinite(norm) and norm > 0.0):
            raise GeometryError(f"{path}: joint '{joint.name}' has axis {axis.tolist()}")
        axis /= norm
        if joint.name not in maps:
            held = _held(joint)
            self.fixed[joint.name] = held
            lone = Chain((0,), pose[None], axis[None], (joint.type in TURNING,), (1,), _ONE)
            return frame, ForwardKinematics(lone).links(np.array([[held]]))[0, 0]
        self.joint_names.append(joint.name)
        self._parent.append(frame)
        self._origin.append(pose)
        self._axis.append(axis)
        self._revolute.append(joint.type in TURNING)
        return len(self._parent), np.eye(4)


def _held(joint: Any) -> float:
    """0, or the limit nearest to it."""
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return 0.0
    return float(np.clip(0.0, limit.lower, limit.upper))


def _link_mesh(link: Any, path: Path, folders: Folders | None) -> TriangleMesh | None:
    parts = []
    for shape in link.collisions or link.visuals:
        origin = np.eye(4) if shape.origin is None else np.asarray(shape.origin, dtype=float)
        if not np.isfinite(origin).all():
            raise GeometryError(f"{path}: link '{link.name}': its origin is not finite")
        parts.append(_shape_mesh(shape.geometry, link.name, path, folders).moved(origin))
    if not parts:
        return None
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = np.concatenate([p.faces + o for p, o in zip(parts, offsets, strict=True)])
    vertices = np.concatenate([part.vertices for part in parts])
    notes = [note for part in parts for note in part.notes]
    name = f"{path}: link '{link.name}'"
    mesh = checked_mesh(vertices, faces, name, notes=notes)
    return replace(mesh, notes=(*mesh.notes, *open_words(mesh, name)))


def _shape_mesh(geometry: Any, link: str, path: Path, folders: Folders | None) -> TriangleMesh:
    where = f"{path}: link '{link}'"
    if geometry.mesh is not None:
        file = mesh_file(str(geometry.mesh.filename), path, folders)
        scale = 1.0 if geometry.mesh.scale is None else np.asarray(geometry.mesh.scale, dtype=float)
        if not (np.isfinite(scale).all() and np.all(scale != 0.0)):
            raise GeometryError(f"{where}: mesh {file} has scale {scale}")
        mesh = load_mesh(file, np.array(np.broadcast_to(scale, 3)))
        extent = float(np.ptp(mesh.vertices, axis=0).max())
        said = check_extent(extent, f"{where}: {file}", LINK_MOST_M)
        return replace(mesh, notes=(*mesh.notes, *said))
    if geometry.box is not None:
        sizes = np.asarray(geometry.box.size, dtype=float)
    elif geometry.cylinder is not None:
        sizes = np.array([geometry.cylinder.radius, geometry.cylinder.length], dtype=float)
    elif geometry.sphere is not None:
        sizes = np.array([geometry.sphere.radius], dtype=float)
    else:
        raise GeometryError(f"{where}: geometry that is no mesh, box, cylinder or sphere")
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        raise GeometryError(f"{where}: a shape of size {sizes.tolist()}")
    if geometry.box is not None:
        return box_mesh(sizes)
    return ball_mesh(sizes[0]) if len(sizes) == 1 else prism_mesh(sizes[0], sizes[1])


def mesh_file(name: str, urdf: Path, folders: Folders | None) -> Path:
    """Find a mesh: beside the URDF, or for package://NAME/REST in or above its folder.

    Raises:
        GeometryError: it is not there, or lies outside of ``folders``.
    """
    try:
        file = _named_file(name, urdf)
        if folders is None or folders.hold(file):
            file.is_file()  # raises where no file can have such a name
            return file
        wrong, remedy = folders.refusal(file)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise GeometryError(f"{urdf}: mesh {name!r} cannot be looked for ({reason})") from None
    raise GeometryError(f"{urdf}: mesh {name!r} {wrong}; {remedy}")


def _named_file(name: str, urdf: Path) -> Path:
    folder = urdf.resolve().parent
    if not name.startswith("package://"):
        return folder / name.removeprefix("file://")
    package, _, rest = name.removeprefix("package://").partition("/")
    for above in (folder, *folder.parents):
        for found in (above / package / rest, above / rest):
            if found.is_file():
                return found
    raise GeometryError(f"{urdf}: mesh '{name}' is neither in '{package}' nor above {folder}")
