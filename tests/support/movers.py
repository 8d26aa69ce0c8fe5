"""Objects that move, and poses of them, for tests of the core."""

from __future__ import annotations

import numpy as np

from rampe_guard.core.scene import Sphere
from rampe_guard.core.types import FloatArray, ObjectSample, Point


def truck(name: str = "truck", *, max_speed: float = 2.0, timeout_s: float = 1.0) -> Sphere:
    """A keyed sphere of half a metre about its own origin, margin 0.1 m."""
    return Sphere(
        name=name,
        margin_m=0.1,
        radius_m=0.5,
        center_m=(0.0, 0.0, 0.0),
        key=f"site/{name}/pose",
        max_speed=max_speed,
        timeout_s=timeout_s,
    )


def at(x: float = 0.0, *, y: float = 0.0, yaw: float = 0.0) -> FloatArray:
    """Pose (4, 4) on the ground."""
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:2, 3] = x, y
    return pose


def seen(
    pose: FloatArray | Point | float,
    stamp_s: float,
    arrival_s: float | None = None,
    name: str = "truck",
) -> ObjectSample:
    """A pose (or x alone) of an object; stamp and arrival are the same unless told."""
    matrix = at(float(pose)) if isinstance(pose, int | float) else np.asarray(pose, dtype=float)
    return ObjectSample(name, matrix, stamp_s, stamp_s if arrival_s is None else arrival_s)
