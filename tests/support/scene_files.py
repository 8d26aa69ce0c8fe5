"""Files of other kinds for the importers of scenes, and who asks FCL what a scene holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import fcl
import numpy as np

from rampe_guard.cli import main
from rampe_guard.collision.mesh import load_mesh
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Mesh, SceneObject, Sphere
from rampe_guard.core.types import FloatArray
from rampe_guard.scene_tools.scene_text import SceneText, folders_of

MOVEIT = """\
(noname)+
* table top
1 2 0.5
0 0 0 1
2
box
1 2 0.1
0 0 0
0 0 0.70710678 0.70710678
0 0 0 0
cylinder
0.05 0.5
0 0 -0.3
0 0 0 1
0 0 0 0
1
grip
0 0 0
0 0 0 1
* cone
0 0 0
0 0 0 1
1
cone
0.5 1
3 0 0.5
0 0 0 1
1 0 0 1
0
* wedge
0 0 0
0 0 0 1
1
mesh
4 4
0 0 0
1 0 0
0 1 0
0 0 1
0 2 1
0 1 3
0 3 2
1 2 3
-3 3 0
0 0 0 1
0 0 0 0
0
* floor
0 0 0
0 0 0 1
1
plane
0 0 2 0
0 0 0
0 0 0 1
0 0 0 0
0
.
"""
MOVEIT_OLD = """\
(noname)+
* ball
2
sphere
0.25
1 0 0.5
0 0 0 1
0 0 0 0
box
1 1 0
0 0 0
0 0 0 1
0 0 0 0
.
"""
"""Of before 2021: without the object's pose and without subframes."""


def run(*words: object) -> int:
    """The command ``rampe-guard scene``, here; its exit code."""
    return main(["scene", *map(str, words)])


def read(path: Path) -> SceneText:
    """A scene file by the loader of the settings."""
    return SceneText.read(path, folders_of(path, ()))


def feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    """A GeoJSON feature."""
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def plan(path: Path, *features: dict[str, Any], **members: Any) -> Path:
    """A GeoJSON file."""
    whole = {"type": "FeatureCollection", "features": list(features), **members}
    path.write_text(json.dumps(whole), encoding="utf-8")
    return path


def away_m(points: FloatArray, item: SceneObject) -> FloatArray:
    """How far points (n, 3) are from an object (n,) [m], 0 inside, by FCL and winding numbers."""
    if isinstance(item, Halfspace):
        return np.asarray(np.maximum(points @ np.array(item.normal) - item.offset_m, 0.0))
    if isinstance(item, Mesh):
        return _away_of_mesh(points, item)
    match item:
        case Box():
            shape, pose = fcl.Box(*item.size_m), item.pose
        case Sphere():
            shape, pose = fcl.Sphere(item.radius_m), _at(np.array(item.center_m))
        case Cylinder():
            shape, pose = fcl.Cylinder(item.radius_m, item.height_m), item.pose
        case Capsule():
            start, end = np.array(item.start_m), np.array(item.end_m)
            length = float(np.linalg.norm(end - start))
            shape, pose = fcl.Capsule(item.radius_m, length), _along(start, end)
        case _:
            raise TypeError(type(item).__name__)
    body = fcl.CollisionObject(shape, fcl.Transform(pose[:3, :3], pose[:3, 3]))
    dot = fcl.Sphere(1e-9)
    found = [
        fcl.distance(fcl.CollisionObject(dot, fcl.Transform(np.eye(3), point)), body)
        for point in points
    ]
    return np.asarray(np.maximum(np.array(found), 0.0), float)


def _away_of_mesh(points: FloatArray, item: Mesh) -> FloatArray:
    mesh = load_mesh(item.file).moved(item.pose, item.scale)
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.faces))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    body = fcl.CollisionObject(model, fcl.Transform())
    inside = np.abs(mesh.winding(points)) > 0.5
    dot = fcl.Sphere(1e-9)
    found = [
        fcl.distance(fcl.CollisionObject(dot, fcl.Transform(np.eye(3), point)), body)
        for point in points
    ]
    return np.asarray(np.where(inside, 0.0, np.maximum(np.array(found), 0.0)))


def _at(place: FloatArray) -> FloatArray:
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose


def _along(start: FloatArray, end: FloatArray) -> FloatArray:
    """A pose in the middle whose z axis points from start to end."""
    pose = _at(0.5 * (start + end))
    z = (end - start) / np.linalg.norm(end - start)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return pose
