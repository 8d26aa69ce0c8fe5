"""The other way to find contacts: dense samples of the motion, FCL `collide` on exact shapes.

It shares no code with the sweep: the URDF is read with ElementTree, kinematics is written with
scipy rotations, shapes are FCL's own primitives, and nothing but `collide` is asked.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fcl
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from rampe_guard.core.drive import joint_value
from rampe_guard.core.scene import Box, Capsule, Cylinder, Mesh, SolidObject, Sphere

if TYPE_CHECKING:
    from rampe_guard.core.arm import ArmDescription
    from rampe_guard.core.types import FloatArray

STEP_M = 0.002


def _origin(element: ET.Element | None) -> FloatArray:
    pose = np.eye(4)
    if element is not None:
        pose[:3, 3] = [float(x) for x in element.get("xyz", "0 0 0").split()]
        rpy = [float(x) for x in element.get("rpy", "0 0 0").split()]
        pose[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    return pose


def _number(element: ET.Element | None, key: str) -> float:
    assert element is not None
    return float(element.get(key, "nan"))


class DenseArm:
    """Links as lists of (pose in the link, FCL shape, vertices), moved by its own kinematics."""

    def __init__(self, description: ArmDescription) -> None:
        path = Path(description.urdf)
        root = ET.parse(path).getroot()  # noqa: S314  # our own files
        self.description = description
        self.joints = {joint.get("name"): joint for joint in root.findall("joint")}
        self.names = [str(link.get("name")) for link in root.findall("link")]
        self.shapes: dict[str, list[tuple[FloatArray, Any, FloatArray]]] = {}
        for link in root.findall("link"):
            found = link.findall("collision") or link.findall("visual")
            self.shapes[str(link.get("name"))] = [
                (_origin(item.find("origin")), *_shape(item.find("geometry"), path))
                for item in found
            ]

    def joint_angles(self, q: FloatArray) -> dict[str, FloatArray]:
        """Joint values (k,) by name for actuator values (k, n)."""
        return {j.joint: joint_value(j.drive, q[:, j.actuator]) for j in self.description.joints}

    def poses(self, q: FloatArray) -> dict[str, FloatArray]:
        """World poses (k, 4, 4) of all links."""
        angles = self.joint_angles(q)
        parents = {j.find("child").get("link"): j for j in self.joints.values()}  # type: ignore[union-attr]
        known: dict[str, FloatArray] = {}

        def pose(name: str) -> FloatArray:
            if name in known:
                return known[name]
            joint = parents.get(name)
            if joint is None:
                known[name] = np.broadcast_to(self.description.base_pose, (len(q), 4, 4))
                return known[name]
            parent = joint.find("parent")
            assert parent is not None
            value = angles.get(str(joint.get("name")), np.zeros(len(q)))
            moved = np.broadcast_to(np.eye(4), (len(q), 4, 4)).copy()
            axis_element = joint.find("axis")
            text = "1 0 0" if axis_element is None else str(axis_element.get("xyz"))
            axis = np.array([float(x) for x in text.split()])
            axis /= np.linalg.norm(axis)
            if joint.get("type") == "prismatic":
                moved[:, :3, 3] = value[:, None] * axis
            elif joint.get("type") != "fixed":
                moved[:, :3, :3] = Rotation.from_rotvec(value[:, None] * axis).as_matrix()
            known[name] = pose(str(parent.get("link"))) @ _origin(joint.find("origin")) @ moved
            return known[name]

        return {name: pose(name) for name in self.names}

    def points(self, name: str, poses: FloatArray) -> FloatArray:
        """Vertices of a link at each pose (k, v, 3)."""
        vertices = [v @ o[:3, :3].T + o[:3, 3] for o, _, v in self.shapes[name]]
        cloud = np.concatenate(vertices)
        return np.asarray(np.einsum("kij,vj->kvi", poses[:, :3, :3], cloud) + poses[:, None, :3, 3])

    def samples(self, start: FloatArray, displacement: FloatArray) -> FloatArray:
        """Fractions so dense that no vertex moves more than about STEP_M between two."""
        rough = np.linspace(0.0, 1.0, 200)
        q = start + rough[:, None] * displacement
        poses = self.poses(q)
        longest = np.zeros(199)
        for name in self.names:
            if self.shapes[name]:
                moved = np.linalg.norm(np.diff(self.points(name, poses[name]), axis=0), axis=2)
                longest = np.maximum(longest, moved.max(axis=1))
        way = np.concatenate([[0.0], np.cumsum(longest)])
        count = int(np.ceil(way[-1] / STEP_M)) + 1
        return np.asarray(np.interp(np.linspace(0.0, way[-1], max(count, 2)), way, rough))


def _shape(geometry: ET.Element | None, urdf: Path) -> tuple[Any, FloatArray]:
    assert geometry is not None
    box, ball = geometry.find("box"), geometry.find("sphere")
    tube, mesh = geometry.find("cylinder"), geometry.find("mesh")
    if box is not None:
        size = np.array([float(x) for x in str(box.get("size")).split()])
        return fcl.Box(*size), np.asarray(trimesh.creation.box(size).vertices)
    if ball is not None:
        radius = _number(ball, "radius")
        return fcl.Sphere(radius), np.asarray(trimesh.creation.icosphere(radius=radius).vertices)
    if tube is not None:
        radius, length = _number(tube, "radius"), _number(tube, "length")
        shape = trimesh.creation.cylinder(radius, length)
        return fcl.Cylinder(radius, length), np.asarray(shape.vertices)
    assert mesh is not None
    loaded = trimesh.load_mesh(str(urdf.parent / str(mesh.get("filename"))))
    return _bvh(loaded), np.asarray(loaded.vertices)


def _bvh(mesh: Any) -> Any:
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.faces))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    return model


def shape_of(item: SolidObject, grow: float = 0.0) -> tuple[Any, float]:
    """FCL object of a scene object grown by ``grow``, and the radius of a ball round it [m]."""
    match item:
        case Box():
            size = np.array(item.size_m) + 2 * grow
            pose = fcl.Transform(item.pose[:3, :3], item.pose[:3, 3])
            return fcl.CollisionObject(fcl.Box(*size), pose), float(np.linalg.norm(size)) / 2
        case Sphere():
            where = fcl.Transform(np.eye(3), np.array(item.center_m))
            radius = item.radius_m + grow
            return fcl.CollisionObject(fcl.Sphere(radius), where), radius
        case Cylinder():
            radius, height = item.radius_m + grow, item.height_m + 2 * grow
            pose = fcl.Transform(item.pose[:3, :3], item.pose[:3, 3])
            return fcl.CollisionObject(fcl.Cylinder(radius, height), pose), radius + height
        case Capsule():
            a, b = np.array(item.start_m), np.array(item.end_m)
            length = float(np.linalg.norm(b - a))
            turn, _ = Rotation.align_vectors([(b - a) / length], [[0, 0, 1]])
            pose = fcl.Transform(turn.as_matrix(), 0.5 * (a + b))
            shape = fcl.Capsule(item.radius_m + grow, length)
            return fcl.CollisionObject(shape, pose), item.radius_m + grow + length
        case Mesh():
            assert grow == 0.0
            loaded = trimesh.load_mesh(item.file)
            loaded.apply_scale(item.scale)
            pose = fcl.Transform(item.pose[:3, :3], item.pose[:3, 3])
            radius = float(np.linalg.norm(loaded.vertices, axis=1).max())
            return fcl.CollisionObject(_bvh(loaded), pose), radius
        case _:
            raise NotImplementedError(item)


@dataclass(frozen=True, slots=True)
class Found:
    """First sample in contact with a zone, and the link that is."""

    fraction: float
    link: str


def first_contacts(
    arm: DenseArm,
    items: list[SolidObject],
    start: FloatArray,
    displacement: FloatArray,
    *,
    grow: float = 0.0,
) -> list[Found | None]:
    """First sampled contact with each object, each grown by ``grow`` (not meshes)."""
    fractions = arm.samples(start, displacement)
    poses = arm.poses(start + fractions[:, None] * displacement)
    answers: list[Found | None] = []
    for item in items:
        body, ball = shape_of(item, grow)
        center = np.asarray(body.getTranslation())
        best: tuple[int, str] | None = None
        for name in arm.names:
            if name in item.ignore_links:
                continue
            for origin, shape, vertices in arm.shapes[name]:
                pose = poses[name] @ origin
                middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
                radius = float(np.linalg.norm(vertices - middle, axis=1).max())
                middles = pose[:, :3, :3] @ middle + pose[:, :3, 3]
                near = np.linalg.norm(middles - center, axis=1) <= radius + ball + 0.01
                moving = fcl.CollisionObject(shape)
                for k in np.flatnonzero(near):
                    if best is not None and k >= best[0]:
                        break
                    moving.setTransform(fcl.Transform(pose[k, :3, :3], pose[k, :3, 3]))
                    if fcl.collide(moving, body, fcl.CollisionRequest(), fcl.CollisionResult()):
                        best = int(k), name
                        break
        answers.append(None if best is None else Found(float(fractions[best[0]]), best[1]))
    return answers


def farthest_motion(
    arm: DenseArm, link: str, start: FloatArray, displacement: FloatArray, a: float, b: float
) -> float:
    """Length of the way of the farthest moving vertex of a link between two fractions [m]."""
    fractions = np.linspace(a, b, 50)
    poses = arm.poses(start + fractions[:, None] * displacement)[link]
    steps = np.linalg.norm(np.diff(arm.points(link, poses), axis=0), axis=2)
    return float(steps.sum(axis=0).max())
