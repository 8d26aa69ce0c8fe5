"""The bench-scale excavator whose joysticks and strokes the replay logs hold; no cylinders drawn.

Root frame: on the swing axis at the height of the boom foot, x ahead at swing 0, z up, [m].
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import linkage as lk
import numpy as np
from manifold3d import Manifold
from parts import XZ, Joint, both_sides, box, curve, pin, plate, post, union, write_urdf

FOOT_X_M = 0.037
BOOM_M, STICK_M, BUCKET_M = 0.482, 0.253, 0.115
STROKES_M = {"boom": (0.0, 0.118), "stick": (0.0, 0.145), "bucket": (0.0, 0.11)}


def boom_angle(stroke: float) -> float:
    """Boom over the horizontal [rad]."""
    return lk.corner(0.22, 0.078, 0.163 + stroke) - 0.39853 - 0.8161


def stick_angle(stroke: float) -> float:
    """Stick relative to the boom [rad]."""
    return pi - 0.48263 - 2.77961 - lk.corner(0.267, 0.081, 0.194 + stroke)


def bucket_angle(stroke: float) -> float:
    """Bucket relative to the stick [rad]."""
    h = pi - 0.21197 - lk.corner(0.212, 0.06, 0.1555 + stroke)
    r = float(np.sqrt(0.04**2 + 0.06**2 - 2 * 0.04 * 0.06 * np.cos(h)))
    return pi - 1.65879 - 0.08703 - lk.corner(r, 0.04, 0.06) - lk.corner(r, 0.047, 0.06)


def links() -> dict[str, Manifold]:
    """Every link by name, root first."""
    pedestal = union(
        box((-0.14, -0.14, -0.22), (0.14, 0.14, -0.19)),
        post((0.0, 0.0, -0.20), 0.04, 0.15),
        post((0.0, 0.0, -0.06), 0.06, 0.015),
    )
    cheek = plate([(-0.05, -0.04), (0.10, -0.04), (0.10, -0.02), (FOOT_X_M + 0.015, 0.015),
                   (FOOT_X_M - 0.015, 0.015)], 0.027, 0.033)  # fmt: skip
    house = union(
        box((-0.10, -0.06, -0.045), (0.10, 0.06, -0.03)),
        both_sides(cheek),
        box((-0.10, -0.055, -0.035), (-0.04, 0.055, 0.03)),
        pin((FOOT_X_M, 0.0), 0.006, -0.036, 0.036),
    )
    return {
        "base": pedestal,
        "house": house,
        "boom": _boom(),
        "stick": _stick(),
        "bucket": _bucket(),
    }


def _boom() -> Manifold:
    spine: list[XZ] = [(0.0, 0.0), (0.10, 0.055), (0.21, 0.085), (0.33, 0.05), (BOOM_M, 0.0)]
    middle = curve(spine, 17)
    half = np.interp(middle[:, 0], [0.0, 0.2, BOOM_M], [0.012, 0.024, 0.012])
    rise = np.column_stack([0.0 * half, half])
    body = plate(np.vstack([middle - rise, (middle + rise)[::-1]]), -0.022, 0.022)
    return union(
        body, pin((0.0, 0.0), 0.014, -0.024, 0.024), pin((BOOM_M, 0.0), 0.014, -0.028, 0.028)
    )


def _stick() -> Manifold:
    rx, rz = lk.polar(0.081, 2.77961)
    outline: list[XZ] = [(0.0, -0.017), (STICK_M, -0.010), (STICK_M + 0.01, 0.0), (STICK_M, 0.010),
                         (0.05, 0.030), (rx, rz + 0.010), (rx - 0.010, rz - 0.005)]  # fmt: skip
    return union(plate(outline, -0.018, 0.018), pin((STICK_M, 0.0), 0.008, -0.026, 0.026))


def _bucket() -> Manifold:
    """Open shell, 0.10 m wide, tip at x = 0.115 m, back on the +z side."""
    outer: list[XZ] = [(0.010, -0.020), (0.006, 0.030), (0.025, 0.055), (0.060, 0.052),
                       (0.095, 0.022), (BUCKET_M, 0.0)]  # fmt: skip
    inner: list[XZ] = [(0.013, -0.060), (0.009, 0.029), (0.027, 0.052), (0.059, 0.049),
                       (0.092, 0.020), (0.108, 0.001), (0.108, -0.060)]  # fmt: skip
    shell = plate(outer, -0.05, 0.05) - plate(inner, -0.047, 0.047)
    ear = plate([(-0.010, -0.010), (0.009, -0.012), (0.009, 0.045), (-0.012, 0.045)], 0.020, 0.024)
    return union(shell, both_sides(ear), pin((0.0, 0.0), 0.006, -0.03, 0.03))


def joints() -> list[Joint]:
    """Joints with the limits that the strokes give."""

    def turn(name: str, parent: str, x: float, ends: tuple[float, float]) -> Joint:
        span = (min(ends), max(ends))
        return Joint(f"{name}_joint", "revolute", parent, name, (x, 0.0, 0.0), limits=span)

    low, high = STROKES_M["boom"]
    boom = turn("boom", "house", FOOT_X_M, (boom_angle(low), boom_angle(high)))
    low, high = STROKES_M["stick"]
    stick = turn("stick", "boom", BOOM_M, (stick_angle(low), stick_angle(high)))
    low, high = STROKES_M["bucket"]
    bucket = turn("bucket", "stick", STICK_M, (bucket_angle(low), bucket_angle(high)))
    swing = Joint("swing_joint", "continuous", "base", "house", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return [swing, boom, stick, bucket]


def build(folder: Path) -> int:
    """Write the URDF and its meshes; return the number of triangles."""
    return write_urdf(folder / "bench.urdf", "bench_excavator", links(), joints())
