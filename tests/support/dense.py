"""The other way to see a motion: an arm read, posed and placed by code of its own.

It shares nothing with the sweep but the description of the site: the URDF is read with
ElementTree, drives are those of `tests.support.linkages`, poses are products of matrices.
`first_contacts` is the plainest oracle there is: `collide` at every sample, nothing skipped.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import fcl
import numpy as np
from scipy.spatial.transform import Rotation

from tests.support.bodies import (
    LinkBody,
    Surface,
    box_surface,
    cylinder_surface,
    link_body,
    read_surface,
    segment,
)
from tests.support.linkages import joint_from_actuator
from tests.support.obstacles import Obstacle

if TYPE_CHECKING:
    from rampe_guard.core.arm import ArmDescription
    from rampe_guard.core.scene import SolidObject
    from rampe_guard.core.types import FloatArray

STEP_M = 0.001
"""Longest way of any point between two samples [m]."""


@dataclass(frozen=True, slots=True)
class _Step:
    """One joint on the way to a link: fixed ``origin``, then the joint's own motion."""

    origin: FloatArray
    joint: str
    axis: FloatArray
    slides: bool


class DenseArm:
    """An arm as the URDF and the site describe it.

    Attributes:
        names: of all links.
        bodies: geometry per link; None where it has none.
    """

    def __init__(self, description: ArmDescription) -> None:
        path = Path(description.urdf)
        root = ET.parse(path).getroot()  # noqa: S314  # our own files
        self._base = np.asarray(description.base_pose, dtype=float)
        self._drives = {joint.joint: joint for joint in description.joints}
        self._above: dict[str, ET.Element] = {}
        for joint in root.findall("joint"):
            assert joint.find("mimic") is None, "mimic joints are not read here"
            child = joint.find("child")
            assert child is not None
            self._above[str(child.get("link"))] = joint
        self.names = [str(link.get("name")) for link in root.findall("link")]
        self._steps = {name: self._way_to(name) for name in self.names}
        self.bodies = {
            str(link.get("name")): link_body(
                [_part(item, path) for item in link.findall("collision") or link.findall("visual")]
            )
            for link in root.findall("link")
        }

    def body(self, name: str) -> LinkBody:
        """The geometry of a link that has one."""
        body = self.bodies[name]
        assert body is not None, f"link {name} has no geometry"
        return body

    def pose(self, name: str, q: FloatArray) -> FloatArray:
        """World pose (4, 4) of one link for actuator values (n,)."""
        pose = self._base
        for step in self._steps[name]:
            pose = pose @ step.origin
            if step.joint not in self._drives:
                continue
            joint = self._drives[step.joint]
            value = joint_from_actuator(joint.drive, float(q[joint.actuator]))
            pose = pose @ _moved(step, np.array([value]))[0]
        return pose

    def poses(self, q: FloatArray) -> dict[str, FloatArray]:
        """World poses (k, 4, 4) of all links for actuator values (k, n)."""
        turned: dict[str, FloatArray] = {}
        for name, joint in self._drives.items():
            values = q[:, joint.actuator].tolist()
            turned[name] = np.array([joint_from_actuator(joint.drive, v) for v in values])
        found = {}
        for name in self.names:
            pose = np.broadcast_to(self._base, (len(q), 4, 4))
            for step in self._steps[name]:
                pose = pose @ step.origin
                if step.joint in turned:
                    pose = pose @ _moved(step, turned[step.joint])
            found[name] = pose
        return found

    def way(self, name: str, poses: FloatArray) -> FloatArray:
        """Longest way (k - 1,) of any point of a link from each pose (k, 4, 4) to the next [m]."""
        body = self.body(name)
        moved = np.diff(poses, axis=0)
        steps = body.hull @ moved[:, :3, :3].transpose(0, 2, 1) + moved[:, None, :3, 3]
        longest = np.sqrt((steps * steps).sum(axis=2)).max(axis=1)
        turned = np.sqrt((moved[:, :3, :3] ** 2).sum(axis=(1, 2)))
        return np.asarray(longest + turned * body.reach)

    def samples(self, start: FloatArray, displacement: FloatArray) -> FloatArray:
        """Fractions so dense that no point moves more than about STEP_M between two."""
        rough = np.linspace(0.0, 1.0, 400)
        poses = self.poses(start + rough[:, None] * displacement)
        ways = [self.way(name, poses[name]) for name in self.names if self.bodies[name]]
        way = np.concatenate([[0.0], np.cumsum(np.max(ways, axis=0))])
        count = max(int(np.ceil(way[-1] / STEP_M)) + 1, 2)
        return np.asarray(np.interp(np.linspace(0.0, way[-1], count), way, rough))

    def _way_to(self, name: str) -> list[_Step]:
        joint = self._above.get(name)
        if joint is None:
            return []
        parent = joint.find("parent")
        assert parent is not None
        element = joint.find("axis")
        text = "1 0 0" if element is None else str(element.get("xyz"))
        axis = np.array([float(x) for x in text.split()])
        axis /= np.linalg.norm(axis)
        slides = joint.get("type") == "prismatic"
        step = _Step(_origin(joint.find("origin")), str(joint.get("name")), axis, slides)
        return [*self._way_to(str(parent.get("link"))), step]


def _moved(step: _Step, values: FloatArray) -> FloatArray:
    """Motion (k, 4, 4) of a joint by values (k,)."""
    moved = np.zeros((len(values), 4, 4))
    moved[:, 3, 3] = 1.0
    if step.slides:
        moved[:, :3, :3] = np.eye(3)
        moved[:, :3, 3] = values[:, None] * step.axis
        return moved
    x, y, z = step.axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(values)[:, None, None], np.cos(values)[:, None, None]
    moved[:, :3, :3] = np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
    return moved


def _origin(element: ET.Element | None) -> FloatArray:
    pose = np.eye(4)
    if element is not None:
        pose[:3, 3] = [float(x) for x in element.get("xyz", "0 0 0").split()]
        rpy = [float(x) for x in element.get("rpy", "0 0 0").split()]
        pose[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    return pose


def _part(item: ET.Element, urdf: Path) -> tuple[Surface, float]:
    """Triangles in the link's frame and their thickness [m]."""
    surface, radius = _shape(item.find("geometry"), urdf)
    return surface.moved(_origin(item.find("origin"))), radius


def _shape(geometry: ET.Element | None, urdf: Path) -> tuple[Surface, float]:
    assert geometry is not None
    box, ball = geometry.find("box"), geometry.find("sphere")
    tube, mesh = geometry.find("cylinder"), geometry.find("mesh")
    if box is not None:
        return box_surface(np.array([float(x) for x in str(box.get("size")).split()])), 0.0
    if ball is not None:
        return segment(np.zeros(3), np.zeros(3)), float(str(ball.get("radius")))
    if tube is not None:
        radius, length = float(str(tube.get("radius"))), float(str(tube.get("length")))
        return cylinder_surface(radius, length), 0.0
    assert mesh is not None
    scale = np.array([float(x) for x in mesh.get("scale", "1 1 1").split()])
    return read_surface(_found(str(mesh.get("filename")), urdf), scale), 0.0


def _found(name: str, urdf: Path) -> Path:
    """package://NAME/REST is REST in the nearest folder above that has it."""
    if not name.startswith("package://"):
        return urdf.parent / name
    package, _, rest = name.removeprefix("package://").partition("/")
    above = urdf.resolve().parents
    return next(f for a in above for f in (a / package / rest, a / rest) if f.is_file())


@dataclass(frozen=True, slots=True)
class Found:
    """First sample in contact with a zone, and the link that is."""

    fraction: float
    link: str


def first_contacts(
    arm: DenseArm, items: list[SolidObject], start: FloatArray, displacement: FloatArray
) -> list[Found | None]:
    """First sampled contact with each object itself (margins aside), by `collide` alone."""
    fractions = arm.samples(start, displacement)
    poses = arm.poses(start + fractions[:, None] * displacement)
    answers: list[Found | None] = []
    for item in items:
        solid = Obstacle(item).solid
        best: tuple[int, str] | None = None
        for name in arm.names:
            body = arm.bodies[name]
            if body is not None and name not in item.ignore_links:
                last = len(fractions) if best is None else best[0]
                hit = _first_hit(body, solid, poses[name][:last])
                best = best if hit is None else (hit, name)
        answers.append(None if best is None else Found(float(fractions[best[0]]), best[1]))
    return answers


def _first_hit(body: LinkBody, solid: fcl.CollisionObject, poses: FloatArray) -> int | None:
    for k, pose in enumerate(poses):
        for piece in body.pieces:
            moving = piece.place_solid(pose)
            if fcl.collide(moving, solid, fcl.CollisionRequest(), fcl.CollisionResult()):
                return k
    return None
