"""Tesseract: Bullet's hulls cast along sub-segments of at most 0.05 rad.

A hull cast between two poses does not hold the arc between them, and the contact time that it
tells is a guess: no guarantee. The scene keeps its exact convex parts.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tesseract_robotics
from tesseract_robotics import (
    tesseract_collision,
    tesseract_common,
    tesseract_environment,
    tesseract_geometry,
)

from tests.benchmarks.peers.posing import Posing

if TYPE_CHECKING:
    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Motion, Piece, Solid, Work

SUB_SEGMENT_RAD = 0.05
PLUGINS = """contact_manager_plugins:
  search_paths: [{folder}]
  search_libraries: [{library}]
  discrete_plugins:
    default: BulletDiscreteBVHManager
    plugins:
      BulletDiscreteBVHManager: {{class: BulletDiscreteBVHManagerFactory}}
  continuous_plugins:
    default: BulletCastBVHManager
    plugins:
      BulletCastBVHManager: {{class: BulletCastBVHManagerFactory}}
"""


class CastTesseract:
    """Cast hulls, sub-segment by sub-segment, in Bullet's own broad phase."""

    def __init__(self, work: Work, folder: Path) -> None:
        self._posing = Posing(work.machine)
        self._motions = work.motions
        self._nodes = [self._fractions(work, motion) for motion in work.motions]
        frames = [work.machine.arm.chain.link_frame[link] for link in work.machine.links]
        self._moving = [k for k, frame in enumerate(frames) if frame > 0]
        self._names = tesseract_common.VectorString([f"link-{k}" for k in self._moving])
        self._environment = _environment(len(frames), folder)
        self._manager = self._environment.getContinuousContactManager()
        for link in self._moving:
            self._add(f"link-{link}", _hull(work.machine.hulls[link]), np.eye(4))
        for number, piece in enumerate(work.pieces):
            self._add(f"piece-{number}", _shape(piece), piece.pose)
        self._manager.setActiveCollisionObjects(self._names)
        self._manager.setDefaultCollisionMarginData(0.0)
        kinds = tesseract_collision
        self._first = kinds.ContactRequest(kinds.ContactTestType_FIRST)
        self._first.calculate_penetration = False  # without the distance it misses contacts
        self._all = kinds.ContactRequest(kinds.ContactTestType_ALL)
        self._found = kinds.ContactResultMap()
        self._matrix, self._pose = np.eye(4), tesseract_common.Isometry3d(np.eye(4))
        self._ends = [tesseract_common.VectorIsometry3d() for _ in range(2)]
        for poses in self._ends:
            for _ in self._moving:
                poses.append(self._pose)

    def first_contact(self, number: int) -> float | None:
        """The earliest time that the first sub-segment in contact tells."""
        nodes = self._nodes[number]
        rotations, translations = self._posing.poses(self._motions[number], nodes)
        before, after = self._ends
        self._put(before, rotations[0], translations[0])
        for k in range(1, len(nodes)):
            self._put(after, rotations[k], translations[k])
            self._manager.setCollisionObjectsTransform(self._names, before, after)
            self._found.clear()
            self._manager.contactTest(self._found, self._first)
            if self._found.size():
                share = self._earliest()
                return float(nodes[k - 1] + share * (nodes[k] - nodes[k - 1]))
            before, after = after, before
        return None

    def _earliest(self) -> float:
        self._found.clear()
        self._manager.contactTest(self._found, self._all)
        results = tesseract_collision.ContactResultVector()
        self._found.flattenCopyResults(results)
        times = [time for result in results for time in result.cc_time if time >= 0.0]
        return min(times, default=0.0)

    def _fractions(self, work: Work, motion: Motion) -> FloatArray:
        arm = work.machine.arm
        ends = np.stack([motion.start, motion.start + motion.displacement])
        moved = [
            abs(float(np.diff(joint.value(ends[:, joint.actuator]))[0]))
            for joint, turns in zip(arm.joints, arm.chain.revolute, strict=True)
            if turns
        ]
        count = max(int(np.ceil(max(moved) / SUB_SEGMENT_RAD)), 1)
        return np.linspace(0.0, 1.0, count + 1)

    def _put(self, poses: Any, rotations: FloatArray, translations: FloatArray) -> None:
        """Overwrite the poses of the moving links: to make new ones costs eight times as much."""
        matrix, pose = self._matrix, self._pose
        for row, link in enumerate(self._moving):
            matrix[:3, :3], matrix[:3, 3] = rotations[link], translations[link]
            pose.setMatrix(matrix)
            poses[row] = pose

    def _add(self, name: str, shape: Any, pose: FloatArray) -> None:
        shapes, poses = tesseract_geometry.GeometriesConst(), tesseract_common.VectorIsometry3d()
        shapes.append(shape)
        poses.append(tesseract_common.Isometry3d(pose))
        self._manager.addCollisionObject(name, 0, shapes, poses, True)  # noqa: FBT003  # C++


def _environment(links: int, folder: Path) -> Any:
    """A world of links without shapes: its managers know in C++ that links may touch links."""
    package = Path(tesseract_robotics.__file__).parent
    libraries = package.with_name("tesseract_robotics.libs")
    bullet = next(libraries.glob("libtesseract_collision_bullet_factories*")).stem
    plugins = folder / "contact-managers.yaml"
    text = PLUGINS.format(folder=libraries, library=bullet.removeprefix("lib"))
    plugins.write_text(text, encoding="utf-8")
    bodies = "".join(
        f'<link name="link-{k}"/><joint name="joint-{k}" type="fixed"><parent link="world"/>'
        f'<child link="link-{k}"/></joint>'
        for k in range(links)
    )
    allowed = "".join(
        f'<disable_collisions link1="link-{a}" link2="link-{b}" reason="not asked"/>'
        for a in range(links)
        for b in range(a)
    )
    environment = tesseract_environment.Environment()
    ready = environment.init(
        f'<robot name="arm"><link name="world"/>{bodies}</robot>',
        f'<robot name="arm" version="1.0.0">'
        f'<contact_managers_plugin_config filename="file://{plugins}"/>{allowed}</robot>',
        tesseract_common.GeneralResourceLocator(),
    )
    if not ready:
        raise RuntimeError("tesseract cannot set up its contact managers")
    return environment


def _hull(solid: Solid) -> Any:
    vertices = tesseract_common.VectorVector3d()
    for vertex in solid.vertices:
        vertices.append(vertex)
    corners = np.full((len(solid.faces), 1), 3)
    faces = np.hstack([corners, solid.faces]).astype(np.int32).ravel()
    return tesseract_geometry.ConvexMesh(vertices, faces)


def _shape(piece: Piece) -> Any:
    if piece.kind == "ball":
        return tesseract_geometry.Sphere(float(piece.size[0]))
    if piece.kind == "box":
        return tesseract_geometry.Box(*piece.size.tolist())
    return _hull(piece.solid)
