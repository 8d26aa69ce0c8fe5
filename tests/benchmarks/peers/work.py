"""What all are asked: an arm, a scene and motions. Every peer gets it ready, in its own form."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from rampe_guard.collision import Arm, load_arm
from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.drive import DirectDrive
from rampe_guard.core.kinematics import ForwardKinematics
from rampe_guard.core.scene import SolidObject
from rampe_guard.settings import load_site

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]
ROOT = Path(__file__).parents[3]
ENDLESS_RAD = 3.0
"""Where a joint has no limits, starts are drawn from ± this."""


@dataclass(frozen=True, slots=True)
class Solid:
    """Triangles of a closed surface: vertices (v, 3) [m], faces (f, 3)."""

    vertices: FloatArray
    faces: IntArray

    def hull(self) -> Solid:
        """Its convex hull, faces turned outwards."""
        hull = ConvexHull(self.vertices)
        used, faces = np.unique(hull.simplices, return_inverse=True)
        corners = self.vertices[used]
        faces = faces.reshape(-1, 3).astype(np.int64)
        a, b, c = np.moveaxis(corners[faces], 1, 0)
        inwards = np.einsum("fi,fi->f", np.cross(b - a, c - a), a - corners.mean(axis=0)) < 0.0
        faces[inwards] = faces[inwards][:, ::-1]
        return Solid(corners, faces)


@dataclass(frozen=True, slots=True)
class Piece:
    """A convex part of an object: a ball, a box or a hull, placed in the world.

    Attributes:
        kind: which.
        size: radius, or edge lengths (3,) [m]; of a hull the half sides of its box (3,).
        pose: of its frame in the world (4, 4) [m].
        solid: its surface in that frame; of a ball an approximation.
        item: index of the object it belongs to.
        exact: it has no point that its object has not.
    """

    kind: Literal["ball", "box", "hull"]
    size: FloatArray
    pose: FloatArray
    solid: Solid
    item: int
    exact: bool = True


@dataclass(frozen=True, slots=True)
class Item:
    """A keep-out object in every form that some peer likes best.

    Attributes:
        zone: as our scene files know it.
        surface: its triangles in the frame of ``pose``; of a ball an approximation.
        pose: (4, 4).
        pieces: convex parts that contain it.
    """

    zone: SolidObject
    surface: Solid
    pose: FloatArray
    pieces: tuple[Piece, ...]


@dataclass(frozen=True, slots=True)
class Motion:
    """A straight way in actuator space: start (n,) and displacement (n,) [unit]."""

    start: FloatArray
    displacement: FloatArray


@dataclass(frozen=True, slots=True)
class Machine:
    """An arm, and how motions of it are drawn.

    Attributes:
        arm: loaded by the guard's own reader; kinematics of the peers are checked against it.
        description: of the arm.
        links: those with geometry; all arrays over links (L) are in this order.
        meshes: exact surface of each, in the link's frame.
        hulls: convex hull of each.
        reach_m: about how far it comes from its base.
        floor_m: height of its lowest point that never moves.
        tolerance_m: how early a contact may be called.
        room: radius of the ball that 100 objects fill [reach].
        moving: how many actuators move at a time.
        share: largest move [rad], or [share of the range] where ``relative``.
    """

    arm: Arm
    description: ArmDescription
    links: tuple[int, ...]
    meshes: tuple[Solid, ...]
    hulls: tuple[Solid, ...]
    reach_m: float
    floor_m: float
    tolerance_m: float
    room: float
    moving: int
    share: float
    relative: bool

    @property
    def name(self) -> str:
        """Of the URDF."""
        return self.arm.name

    def draw(self, rng: np.random.Generator, moving: int | None = None) -> Motion:
        """A random motion within the limits."""
        lower = np.where(np.isfinite(self.arm.limits[:, 0]), self.arm.limits[:, 0], -ENDLESS_RAD)
        upper = np.where(np.isfinite(self.arm.limits[:, 1]), self.arm.limits[:, 1], ENDLESS_RAD)
        lower, upper = np.maximum(lower, -2 * np.pi), np.minimum(upper, 2 * np.pi)
        start = rng.uniform(lower, upper)
        chosen = rng.permutation(len(start))[: moving or self.moving]
        most = self.share * (upper - lower) if self.relative else np.full(len(start), self.share)
        end = start.copy()
        end[chosen] += rng.uniform(-1.0, 1.0, len(chosen)) * most[chosen]
        end = np.clip(end, lower, upper)
        return Motion(start, end - start)


@dataclass(frozen=True, slots=True)
class Work:
    """A machine in a scene, and the motions that are asked about."""

    machine: Machine
    items: tuple[Item, ...]
    motions: tuple[Motion, ...]
    kind: str

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """Convex parts of all objects."""
        return tuple(piece for item in self.items for piece in item.pieces)


class Peer(Protocol):
    """One way to answer: ready for one machine in one scene."""

    def first_contact(self, number: int) -> float | None:
        """First fraction in [0, 1] of motion ``number`` called a contact; None if free."""
        ...


def foreign_machine(urdf: Path, tolerance_m: float) -> Machine:
    """Any arm whose URDF is given: every joint driven directly, two of them move at a time."""
    root = ET.parse(urdf).getroot()  # noqa: S314  # a file that the caller trusts
    joints = [
        str(joint.get("name"))
        for joint in root.findall("joint")
        if joint.get("type") in ("revolute", "continuous", "prismatic")
        and joint.find("mimic") is None
    ]
    drives = tuple(JointDrive(name, i, DirectDrive()) for i, name in enumerate(joints))
    description = ArmDescription(str(urdf), np.eye(4), drives, ((None, None),) * len(drives))
    return _machine(description, tolerance_m, _Habit(room=1.15, moving=2, share=1.0))


def excavator(tolerance_m: float) -> Machine:
    """The excavator of the demo with its cylinders and four-bar; all four actuators move."""
    site = load_site(ROOT / "config" / "sites" / "demo.yaml")
    return _machine(site.arm, tolerance_m, _Habit(room=1.9, moving=4, share=0.25, relative=True))


class _Habit(NamedTuple):
    """How scenes and motions of a machine are drawn, see `Machine`."""

    room: float
    moving: int
    share: float
    relative: bool = False


def _machine(description: ArmDescription, tolerance_m: float, habit: _Habit) -> Machine:
    arm = load_arm(description)
    links = tuple(i for i, mesh in enumerate(arm.meshes) if mesh is not None)
    meshes = tuple(Solid(mesh.vertices, mesh.faces) for mesh in arm.meshes if mesh is not None)
    hulls = tuple(mesh.hull() for mesh in meshes)
    reach, floor = _extent(arm, links, hulls)
    return Machine(
        arm=arm,
        description=description,
        links=links,
        meshes=meshes,
        hulls=hulls,
        reach_m=reach,
        floor_m=floor,
        tolerance_m=tolerance_m,
        **habit._asdict(),
    )


def _extent(arm: Arm, links: tuple[int, ...], hulls: tuple[Solid, ...]) -> tuple[float, float]:
    """Farthest distance from the base over random postures, lowest point of what stands still."""
    rng = np.random.default_rng(0)
    lower, upper = np.clip(arm.limits.T, -ENDLESS_RAD, ENDLESS_RAD)
    q = rng.uniform(lower, upper, (200, len(lower)))
    theta = np.column_stack([joint.value(q[:, joint.actuator]) for joint in arm.joints])
    poses = ForwardKinematics(arm.chain).links(theta)
    reach, floor = 0.0, np.inf
    for link, hull in zip(links, hulls, strict=True):
        cloud = np.einsum("kij,vj->kvi", poses[:, link, :3, :3], hull.vertices)
        cloud += poses[:, None, link, :3, 3]
        reach = max(reach, float(np.linalg.norm(cloud, axis=2).max()))
        if arm.chain.link_frame[link] == 0:
            floor = min(floor, float(cloud[0, :, 2].min()))
    return reach, floor if np.isfinite(floor) else -0.1 * reach
