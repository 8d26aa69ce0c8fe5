"""Another's eyes on a robot: pinocchio reads its URDF and poses it, coal looks for contacts.

Nothing is shared with the sweep but the file: links, joints, meshes and boxes are theirs.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rampe_guard.core.scene import Box
    from rampe_guard.core.types import FloatArray

STEP_M = 0.005
"""Longest way of any point between two samples [m]."""
FAR_M = 1e3


@dataclass(frozen=True, slots=True)
class _Body:
    """A shape of a link: its number among pinocchio's, and a ball round it in its frame [m]."""

    number: int
    shape: Any
    center: FloatArray
    radius: float


class Witness:
    """A robot as pinocchio reads it.

    Args:
        urdf: the file.
        package_dirs: folders that hold its packages.
    """

    def __init__(self, urdf: Path, package_dirs: tuple[str, ...]) -> None:
        import pinocchio as pin  # noqa: PLC0415  # in few environments

        self._pin = pin
        with _seen(urdf, package_dirs) as places, _silence():
            self._model = pin.buildModelFromUrdf(str(urdf))
            self._seen = self._shapes(urdf, places)
        self._data = self._model.createData()
        self._mimics = _mimics(urdf)
        self._bodies = [self._body(i) for i in range(len(self._shape_model.geometryObjects))]
        self._bodies = [body for body in self._bodies if body.number in self._seen]

    def _shapes(self, urdf: Path, places: list[str]) -> set[int]:
        """What collides of each link, else what is seen of it."""
        pin = self._pin
        shapes = pin.buildGeomFromUrdf(
            self._model, str(urdf), pin.GeometryType.COLLISION, package_dirs=places
        )
        links = {link.get("name"): link for link in ET.parse(urdf).getroot().findall("link")}  # noqa: S314
        only_seen = {
            str(name) for name, link in links.items()
            if link.find("collision") is None and link.find("visual") is not None
        }  # fmt: skip
        chosen = set(range(len(shapes.geometryObjects)))
        if only_seen:
            pin.buildGeomFromUrdf(
                self._model, str(urdf), pin.GeometryType.VISUAL, shapes, package_dirs=places
            )
            chosen |= {
                i for i, shape in enumerate(shapes.geometryObjects)
                if i not in chosen and self._model.frames[shape.parentFrame].name in only_seen
            }  # fmt: skip
        self._shape_model = shapes
        self._placed = shapes.createData()
        return chosen

    def _body(self, number: int) -> _Body:
        shape = self._shape_model.geometryObjects[number].geometry
        shape.computeLocalAABB()
        return _Body(number, shape, np.array(shape.aabb_center), float(shape.aabb_radius))

    def link_pose(self, link: str, values: Mapping[str, float]) -> FloatArray:
        """World pose (4, 4) of a link for joint values [rad or m]; joints not named are at 0."""
        pin = self._pin
        pin.framesForwardKinematics(self._model, self._data, self._q(values))
        frame = self._model.getFrameId(link, pin.FrameType.BODY)
        return np.array(self._data.oMf[frame].homogeneous)

    def place(self, values: Mapping[str, float]) -> FloatArray:
        """World poses (b, 4, 4) of all shapes."""
        self._pin.updateGeometryPlacements(
            self._model, self._data, self._shape_model, self._placed, self._q(values)
        )
        return np.array([self._placed.oMg[body.number].homogeneous for body in self._bodies])

    def way(self, poses: FloatArray) -> FloatArray:
        """No point moves more (k - 1,) between one of poses (k, b, 4, 4) and the next [m]."""
        centers = np.einsum("kbij,bj->kbi", poses[..., :3, :3], self._centers()) + poses[..., :3, 3]
        moved = np.linalg.norm(np.diff(centers, axis=0), axis=2)
        turned = np.diff(poses[..., :3, :3], axis=0).reshape(len(poses) - 1, len(self._bodies), 9)
        # a rotation by a changes the matrix by 2 √2 sin(a / 2), a chord by 2 sin(a / 2)
        chord = np.linalg.norm(turned, axis=2) / np.sqrt(2.0)
        ways = moved + chord * np.array([body.radius for body in self._bodies])
        return np.asarray(ways.max(axis=1))

    def first_contacts(self, poses: FloatArray, boxes: list[Box]) -> list[int | None]:
        """Per box the first of poses (k, b, 4, 4) at which `collide` finds a contact."""
        import coal  # noqa: PLC0415

        near = self._near(poses, boxes)
        found: list[int | None] = []
        for i, box in enumerate(boxes):
            solid, place = coal.Box(*box.size_m), _transform(coal, box.pose)
            hit = None
            for k, b in np.argwhere(near[:, :, i]).tolist():
                there = _transform(coal, poses[k, b])
                answer = coal.CollisionResult()
                coal.collide(
                    self._bodies[b].shape, there, solid, place, coal.CollisionRequest(), answer
                )
                if answer.isCollision():
                    hit = int(k)
                    break
            found.append(hit)
        return found

    def distance(self, poses: FloatArray, box: Box) -> float:
        """Least distance at poses (b, 4, 4) [m]."""
        import coal  # noqa: PLC0415

        solid, place = coal.Box(*box.size_m), _transform(coal, box.pose)
        best = FAR_M
        for body, pose in zip(self._bodies, poses, strict=True):
            answer = coal.DistanceResult()
            request = coal.DistanceRequest()
            there = _transform(coal, pose)
            best = min(best, coal.distance(body.shape, there, solid, place, request, answer))
        return best

    def _near(self, poses: FloatArray, boxes: list[Box]) -> Any:
        """Whether the ball round a shape meets a box (k, b, boxes)."""
        centers = np.einsum("kbij,bj->kbi", poses[..., :3, :3], self._centers()) + poses[..., :3, 3]
        radii = np.array([body.radius for body in self._bodies])
        answers = []
        for box in boxes:
            local = (centers - box.pose[:3, 3]) @ box.pose[:3, :3]
            over = np.maximum(np.abs(local) - 0.5 * np.array(box.size_m), 0.0)
            answers.append(np.linalg.norm(over, axis=2) <= radii)
        return np.stack(answers, axis=2)

    def _centers(self) -> FloatArray:
        return np.array([body.center for body in self._bodies])

    def _q(self, values: Mapping[str, float]) -> FloatArray:
        values = dict(values)
        for name in self._mimics:
            values.setdefault(name, self._followed(name, values))
        q = np.array(self._pin.neutral(self._model))
        for name, value in values.items():
            if not self._model.existJointName(name):
                continue  # a fixed one
            joint = self._model.joints[self._model.getJointId(name)]
            if joint.nq == 1:
                q[joint.idx_q] = value
            else:  # an endless turn
                q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        return q

    def _followed(self, name: str, values: Mapping[str, float]) -> float:
        if name in values or name not in self._mimics:
            return values.get(name, 0.0)
        source, multiplier, offset = self._mimics[name]
        return multiplier * self._followed(source, values) + offset


def _mimics(urdf: Path) -> dict[str, tuple[str, float, float]]:
    found = {}
    for joint in ET.parse(urdf).getroot().findall("joint"):  # noqa: S314
        mimic = joint.find("mimic")
        if mimic is not None:
            numbers = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            found[str(joint.get("name"))] = (str(mimic.get("joint")), *numbers)
    return found


def _transform(coal: Any, pose: FloatArray) -> Any:
    return coal.Transform3s(np.ascontiguousarray(pose[:3, :3]), np.ascontiguousarray(pose[:3, 3]))


@contextlib.contextmanager
def _seen(urdf: Path, package_dirs: tuple[str, ...]) -> Iterator[list[str]]:
    """Folders in which each package that the URDF names is under its own name."""
    with tempfile.TemporaryDirectory() as folder:
        for package in {
            word.split("/")[0] for word in urdf.read_text("utf-8").split("package://")[1:]
        }:
            for above in urdf.resolve().parents:
                if (above / "package.xml").is_file() and not (above.parent / package).exists():
                    (Path(folder) / package).symlink_to(above)
                    break
        yield [*package_dirs, folder, *(str(above) for above in urdf.resolve().parents[:4])]


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Its parsers talk to the terminal below Python."""
    kept = os.dup(2)
    with open(os.devnull, "w") as nowhere:  # noqa: PTH123
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
