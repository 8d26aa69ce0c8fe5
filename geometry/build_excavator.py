"""The excavator, 20-tonne class: one solid per link, in the link's own frame, and its URDF."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import linkage as lk
import numpy as np
from manifold3d import Manifold
from parts import (
    XZ,
    Joint,
    bar,
    both_sides,
    box,
    curve,
    pin,
    plate,
    post,
    union,
    write_urdf,
)

BOOM_CYLINDER_Y = 0.40
"""The two boom cylinders run beside the boom at ± this [m]."""


def undercarriage() -> Manifold:
    """Two tracks with grousers, rollers and frames, the car body and the slew ring."""
    track = _track().translate((0.0, 1.19, 0.0))
    body = union(
        box((-1.0, -0.55, 0.46), (1.0, 0.55, 0.86)),
        plate([(-1.5, 0.42), (-1.2, 0.42), (-0.5, 0.6), (-0.5, 0.78), (-1.5, 0.56)], -1.0, 1.0),
        plate([(1.5, 0.42), (1.2, 0.42), (0.5, 0.6), (0.5, 0.78), (1.5, 0.56)], -1.0, 1.0),
        post((0.0, 0.0, 0.80), 0.68, 0.14),
        post((0.0, 0.0, 0.90), 0.60, 0.10),
    )
    return union(both_sides(track), body)


def _track() -> Manifold:
    """One track about y = 0: 4.45 m long, 0.60 m wide shoes; it stands on z = 0."""
    half, radius, z = 1.78, 0.40, 0.445
    belt_outer = _stadium(half, radius, z)
    belt = plate(belt_outer, -0.30, 0.30) - plate(_stadium(half, radius - 0.07, z), -1.0, 1.0)
    shoes = []
    length = 4 * half + 2 * pi * radius
    for k in range(32):
        x, height, angle = _along_stadium(k / 32 * length, half, radius)
        shoe = box((-0.06, -0.29, -0.02), (0.06, 0.29, 0.045))
        shoes.append(shoe.rotate((0.0, angle, 0.0)).translate((x, 0.0, z + height)))
    frame = plate([(-1.6, 0.30), (1.6, 0.30), (1.7, 0.46), (1.3, 0.62), (-1.3, 0.62), (-1.7, 0.46)],
                  -0.2, 0.2)  # fmt: skip
    rollers = [pin((-1.2 + 0.4 * k, 0.20), 0.125, -0.17, 0.17) for k in range(7)]
    carriers = [pin((x, 0.72), 0.08, -0.15, 0.15) for x in (-0.6, 0.6)]
    posts = [box((x - 0.06, -0.1, 0.55), (x + 0.06, 0.1, 0.72)) for x in (-0.6, 0.6)]
    ends = [pin((x, z), 0.34, -0.14, 0.14) for x in (-half, half)]
    motor = pin((-half, z), 0.22, -0.30, 0.26)
    return union(belt, *shoes, frame, *rollers, *carriers, *posts, *ends, motor)


def _stadium(half: float, radius: float, z: float) -> list[XZ]:
    angles = np.linspace(-pi / 2, pi / 2, 13)
    front = [(half + radius * cos(a), z + radius * sin(a)) for a in angles]
    return front + [(-x, 2 * z - h) for x, h in front]


def _along_stadium(s: float, half: float, radius: float) -> tuple[float, float, float]:
    """Point (x, height over the centre) and turn about y [°] at arc length ``s`` of the belt."""
    straight, turn = 2 * half, pi * radius
    if s < straight:
        return (s - half, radius, 0.0)
    if s < straight + turn:
        a = (s - straight) / radius
        return (half + radius * sin(a), radius * cos(a), np.degrees(a))
    x, height, angle = _along_stadium(s - straight - turn, half, radius)
    return (-x, -height, angle + 180.0)


def house() -> Manifold:
    """Upper structure: deck, boom bracket, cab on the left, tanks, hood, counterweight."""
    fx, fz = lk.FOOT
    bx, bz = fx + lk.BOOM_CYLINDER.base[0], fz + lk.BOOM_CYLINDER.base[1]
    cheek = plate(
        [(-0.75, 0.1), (bx + 0.14, 0.06), (bx + 0.14, bz + 0.1), (bx - 0.05, bz + 0.16),
         (fx + 0.2, fz + 0.08), (fx, fz + 0.2), (fx - 0.2, fz + 0.08)], 0.27, 0.33)  # fmt: skip
    ear = plate([(bx - 0.2, 0.05), (bx + 0.14, 0.05), (bx + 0.14, bz + 0.1), (bx - 0.1, bz + 0.14)],
                0.49, 0.53)  # fmt: skip
    bracket = union(
        both_sides(union(cheek, ear)),
        pin(lk.FOOT, 0.08, -0.36, 0.36),
        pin((bx, bz), 0.06, -0.55, 0.55),
    )
    return union(
        box((-2.1, -1.30, 0.0), (0.55, 1.30, 0.14)),
        post((0.0, 0.0, -0.02), 0.62, 0.1),
        bracket,
        _cab(),
        _hood(),
        plate([(-0.9, 0.04), (0.85, 0.04), (0.85, 0.55), (0.6, 0.95), (-0.9, 0.95)], -1.33, -0.62),
        _counterweight(),
        post((-1.35, -0.7, 1.2), 0.07, 0.45),
        *[box((0.2 + 0.22 * k, -1.36, 0.2 + 0.22 * k), (0.42 + 0.2 * k, -1.30, 0.24 + 0.22 * k))
          for k in range(3)],
    )  # fmt: skip


def _cab() -> Manifold:
    outline = [(-0.42, 0.06), (1.30, 0.06), (1.42, 0.35), (1.42, 0.85), (1.12, 1.86), (1.0, 1.95),
               (-0.32, 1.95), (-0.42, 1.85)]  # fmt: skip
    cab = plate(outline, 0.60, 1.36)
    side = plate([(-0.25, 1.0), (0.25, 1.0), (0.25, 1.78), (-0.25, 1.78)], 0.0, 2.0)
    door = plate([(0.36, 0.55), (1.28, 0.55), (1.28, 0.85), (1.02, 1.78), (0.36, 1.78)], 0.0, 2.0)
    recess = box((-1.0, 0.62, 0.0), (2.0, 1.34, 3.0))
    windows = (side + door) - recess  # 2 cm deep on both sides
    front = plate([(1.2, 0.7), (1.6, 0.7), (1.6, 1.75), (0.9, 1.75)], 0.67, 1.29) - plate(
        [(-1.0, 0.0), (1.39, 0.0), (1.39, 0.85), (1.09, 1.86), (-1.0, 1.86)], 0.0, 2.0
    )
    return cab - windows - front


def _hood() -> Manifold:
    outline = [(-2.2, 0.05), (-0.45, 0.05), (-0.45, 1.05), (-0.62, 1.22), (-2.2, 1.28)]
    hood = plate(outline, -1.33, 0.45) + plate(
        [(-2.2, 0.05), (-0.55, 0.05), (-0.55, 1.0), (-2.2, 1.0)], 0.4, 1.33
    )
    slots = [box((-1.9 + 0.16 * k, -2.0, 0.45), (-1.82 + 0.16 * k, -1.31, 0.95)) for k in range(6)]
    return hood - union(*slots)


def _counterweight() -> Manifold:
    """Cut from a disc about the swing axis: the tail swings within 2.75 m."""
    disc = Manifold.cylinder(1.2, 2.75, 2.75, 64).translate((0.0, 0.0, 0.06))
    rim = Manifold.cylinder(0.25, 2.75, 2.45, 64).translate((0.0, 0.0, 1.26))
    body = (disc + rim) ^ box((-3.0, -1.36, -1.0), (-2.12, 1.36, 3.0))
    return body - box((-3.0, -0.3, 0.0), (-2.66, 0.3, 0.3))


def boom() -> Manifold:
    """Bent box section, forked at the stick; lugs for both cylinders."""
    count = 33
    spine = [
        (0.0, 0.0),
        (0.6, 0.20),
        (1.5, 0.46),
        (2.4, 0.57),
        (3.4, 0.44),
        (4.6, 0.17),
        (5.75, 0.0),
    ]
    depth = [(0.0, 0.19), (0.8, 0.27), (2.3, 0.36), (3.5, 0.30), (4.8, 0.22), (5.75, 0.15)]
    middle, half = curve(spine, count), curve(depth, count)[:, 1]
    top = np.column_stack([middle[:, 0], middle[:, 1] + half])
    bottom = np.column_stack([middle[:, 0], middle[:, 1] - half])
    body = plate(np.vstack([bottom, top[::-1]]), -0.25, 0.25)
    fork = box((5.15, -0.19, -1.0), (6.0, 0.19, 1.0))
    lug = plate([(2.45, 0.7), (3.05, 0.7), (2.88, 1.04), (2.75, 1.10), (2.62, 1.04)], 0.12, 0.17)
    return union(
        body - fork,
        pin((0.0, 0.0), 0.20, -0.26, 0.26),
        both_sides(pin((lk.BOOM_M, 0.0), 0.16, 0.21, 0.27)),
        pin((lk.BOOM_M, 0.0), 0.06, -0.3, 0.3),
        pin(lk.BOOM_CYLINDER.rod, 0.14, -0.27, 0.27),
        pin(lk.BOOM_CYLINDER.rod, 0.06, -0.50, 0.50),
        both_sides(lug),
        pin(lk.STICK_BASE, 0.05, -0.19, 0.19),
    )


def stick() -> Manifold:
    """Tapered box section with the lever of its cylinder behind and the bucket linkage ahead."""
    rx, rz = lk.STICK_CYLINDER.rod
    outline: list[XZ] = [
        (-0.30, -0.12), (0.0, -0.20), (0.5, -0.22), (1.6, -0.18), (2.78, -0.11), (2.86, -0.13),
        (2.98, -0.10), (3.01, 0.0), (2.97, 0.09), (2.6, 0.17), (1.8, 0.22), (0.9, 0.30),
        (0.5, 0.34), (0.1, 0.36), (-0.3, 0.34), (rx, rz + 0.13), (rx - 0.12, rz), (rx, rz - 0.13),
    ]  # fmt: skip
    bx, bz = lk.BUCKET_BASE
    lug = plate([(bx - 0.3, 0.25), (bx + 0.3, 0.25), (bx + 0.1, bz + 0.08), (bx - 0.1, bz + 0.08)],
                0.10, 0.15)  # fmt: skip
    slot = box((rx - 0.3, -0.11, rz - 0.3), (rx + 0.22, 0.11, rz + 0.3))
    return union(
        plate(outline, -0.17, 0.17) - slot,
        pin((0.0, 0.0), 0.17, -0.185, 0.185),
        pin((rx, rz), 0.05, -0.20, 0.20),
        both_sides(lug),
        pin((bx, bz), 0.05, -0.17, 0.17),
        pin(lk.ROCKER_PIVOT, 0.055, -0.30, 0.30),
        pin((lk.STICK_M, 0.0), 0.11, -0.19, 0.19),
        pin((lk.STICK_M, 0.0), 0.05, -0.34, 0.34),
    )


def bucket() -> Manifold:
    """Open shell of 4 cm plate, 1.2 m wide, with ears and five teeth; tip at x = 1.5 m."""
    half = 0.60
    back = _bezier((0.14, -0.26), (0.02, 0.75), (0.55, 1.02), (1.36, 0.10), 25)
    inner = _bezier((0.18, -0.26), (0.07, 0.70), (0.57, 0.96), (1.30, 0.10), 25)
    inside = np.vstack([[(0.18, -0.6)], inner, [(1.6, -0.02), (1.6, -0.6)]])
    mouth: list[XZ] = [(1.36, 0.03), (0.9, -0.03), (0.4, -0.20), (0.24, -0.26)]
    shell = plate(np.vstack([back, mouth]), -half, half) - plate(inside, -half + 0.04, half - 0.04)
    lip = plate([(1.18, 0.10), (1.36, 0.03), (1.36, 0.10), (1.18, 0.26)], -half, half)
    teeth = []
    for k in range(5):
        y = -0.52 + 0.26 * k
        teeth.append(plate([(1.26, 0.05), (1.5, 0.0), (1.5, 0.02), (1.38, 0.12), (1.26, 0.19)],
                           y - 0.05, y + 0.05))  # fmt: skip
    cutters = both_sides(plate([(0.55, -0.12), (1.25, 0.06), (1.25, 0.16), (0.55, 0.02)],
                               half - 0.03, half + 0.02))  # fmt: skip
    ex, ez = lk.EAR
    ear = plate([(0.26, -0.16), (0.0, -0.13), (-0.12, -0.03), (ex - 0.12, ez - 0.03),
                 (ex - 0.06, ez + 0.11), (ex + 0.06, ez + 0.12), (0.36, 0.62), (0.26, 0.3)],
                0.24, 0.29)  # fmt: skip
    ears = both_sides(ear) - plate(inside, -half + 0.04, half - 0.04)
    return union(
        shell, lip, *teeth, cutters, ears,
        both_sides(pin((0.0, 0.0), 0.10, 0.21, 0.31)),
        both_sides(pin(lk.EAR, 0.09, 0.21, 0.31)),
        pin(lk.EAR, 0.045, -0.31, 0.31),
    )  # fmt: skip


def _bezier(a: XZ, b: XZ, c: XZ, d: XZ, count: int) -> list[XZ]:
    t = np.linspace(0.0, 1.0, count)[:, None]
    p = [np.asarray(point) for point in (a, b, c, d)]
    xz = (1 - t) ** 3 * p[0] + 3 * t * (1 - t) ** 2 * p[1] + 3 * t**2 * (1 - t) * p[2] + t**3 * p[3]
    return [(float(x), float(z)) for x, z in xz]


def rocker() -> Manifold:
    """Two arms beside the stick, from its pivot to the pin of the bucket cylinder."""
    end = lk.ROCKER_M
    arm = plate([(0.0, -0.09), (0.3, -0.06), (end, -0.08), (end + 0.08, 0.0), (end, 0.08),
                 (0.3, 0.06), (0.0, 0.09), (-0.09, 0.0)], 0.22, 0.27)  # fmt: skip
    return union(
        both_sides(union(arm, pin((0.0, 0.0), 0.10, 0.20, 0.29), pin((end, 0.0), 0.09, 0.2, 0.29))),
        pin((end, 0.0), 0.05, -0.30, 0.30),
    )


def coupler() -> Manifold:
    """H-shaped link from the bucket's ears (origin) to the rocker (x axis)."""
    end = lk.COUPLER_M
    side = plate([(0.0, -0.08), (end, -0.07), (end + 0.07, 0.0), (end, 0.07), (0.0, 0.08),
                  (-0.08, 0.0)], 0.12, 0.19)  # fmt: skip
    return union(
        both_sides(side),
        box((0.16, -0.13, -0.05), (0.40, 0.13, 0.05)),
        pin((0.0, 0.0), 0.085, -0.20, 0.20),
        both_sides(pin((end, 0.0), 0.085, 0.11, 0.20)),
    )


def barrel(cylinder: lk.Triangle, radius: float) -> Manifold:
    """Barrel along +x from its pin at the origin, with gland and port block."""
    end = cylinder.retracted_m - 0.16
    return union(
        pin((0.0, 0.0), 0.9 * radius, -0.09, 0.09),
        bar(0.0, end, radius),
        bar(end - 0.16, end, radius + 0.02),
        bar(0.1, 0.2, radius + 0.015),
        box((0.2, -0.04, radius - 0.03), (0.32, 0.04, radius + 0.05)),
        box((end - 0.12, -0.04, radius - 0.03), (end - 0.04, 0.04, radius + 0.05)),
    )


def rod(cylinder: lk.Triangle, radius: float) -> Manifold:
    """Rod along -x from its pin at the origin; all of it but 0.2 m leaves the barrel."""
    return union(
        pin((0.0, 0.0), 1.5 * radius, -0.085, 0.085),
        bar(-cylinder.stroke_m - 0.25, 0.0, radius),
    )


def reverse(solid: Manifold) -> Manifold:
    """Turn about z by half a turn: what ran along +x runs along -x."""
    return solid.rotate((0.0, 0.0, 180.0))


def links() -> dict[str, Manifold]:
    """Every link by name, root first."""
    pair = (0.0, BOOM_CYLINDER_Y, 0.0)
    return {
        "undercarriage": undercarriage(),
        "house": house(),
        "boom": boom(),
        "stick": stick(),
        "bucket": bucket(),
        "boom_barrel": both_sides(barrel(lk.BOOM_CYLINDER, 0.08).translate(pair)),
        "boom_rod": both_sides(rod(lk.BOOM_CYLINDER, 0.045).translate(pair)),
        "stick_rod": reverse(rod(lk.STICK_CYLINDER, 0.05)),
        "stick_barrel": reverse(barrel(lk.STICK_CYLINDER, 0.09)),
        "rocker": rocker(),
        "bucket_rod": reverse(rod(lk.BUCKET_CYLINDER, 0.04)),
        "bucket_barrel": reverse(barrel(lk.BUCKET_CYLINDER, 0.075)),
        "coupler": coupler(),
    }


def joints() -> list[Joint]:
    """Joints with the limits that the strokes give."""
    b, s, k = lk.BOOM_CYLINDER, lk.STICK_CYLINDER, lk.BUCKET_CYLINDER
    along = (1.0, 0.0, 0.0)
    fx, fz = lk.FOOT

    def turn(name: str, parent: str, child: str, at: XZ, limits: tuple[float, float]) -> Joint:
        span = (min(limits), max(limits))
        return Joint(name, "revolute", parent, child, (at[0], 0.0, at[1]), limits=span)

    def slide(name: str, parent: str, child: str, c: lk.Triangle) -> Joint:
        at = (c.retracted_m, 0.0, 0.0)
        return Joint(name, "prismatic", parent, child, at, along, (0.0, c.stroke_m))

    return [
        Joint("swing_joint", "continuous", "undercarriage", "house",
              (0.0, 0.0, lk.SWING_HEIGHT_M), (0.0, 0.0, 1.0)),
        turn("boom_joint", "house", "boom", lk.FOOT,
             (lk.boom_angle(0.0), lk.boom_angle(b.stroke_m))),
        turn("stick_joint", "boom", "stick", (lk.BOOM_M, 0.0),
             (lk.stick_angle(0.0), lk.stick_angle(s.stroke_m))),
        turn("bucket_joint", "stick", "bucket", (lk.STICK_M, 0.0),
             (lk.bucket_angle(0.0), lk.bucket_angle(k.stroke_m))),
        turn("boom_barrel_joint", "house", "boom_barrel", (fx + b.base[0], fz + b.base[1]),
             (lk.boom_barrel_angle(0.0), lk.boom_barrel_angle(b.stroke_m))),
        slide("boom_rod_joint", "boom_barrel", "boom_rod", b),
        turn("stick_rod_joint", "stick", "stick_rod", s.rod,
             (lk.stick_rod_angle(0.0), lk.stick_rod_angle(s.stroke_m))),
        slide("stick_barrel_joint", "stick_rod", "stick_barrel", s),
        turn("rocker_joint", "stick", "rocker", lk.ROCKER_PIVOT,
             (lk.rocker_angle(0.0), lk.rocker_angle(k.stroke_m))),
        turn("bucket_rod_joint", "rocker", "bucket_rod", (lk.ROCKER_M, 0.0),
             (lk.bucket_rod_angle(0.0), lk.bucket_rod_angle(k.stroke_m))),
        slide("bucket_barrel_joint", "bucket_rod", "bucket_barrel", k),
        turn("coupler_joint", "bucket", "coupler", lk.EAR,
             (lk.coupler_angle(0.0), lk.coupler_angle(k.stroke_m))),
    ]  # fmt: skip


def build(folder: Path) -> int:
    """Write the URDF and its meshes; return the number of triangles."""
    return write_urdf(folder / "excavator.urdf", "excavator", links(), joints())


def drives() -> list[str]:
    """The drives of a site file, one YAML line per joint."""
    boom, stick, bucket = lk.BOOM_CYLINDER, lk.STICK_CYLINDER, lk.BUCKET_CYLINDER

    def cylinder(c: lk.Triangle, corner: str, offset: float, direction: int) -> str:
        return (
            f"{{type: cylinder, base_m: {c.base_m:.6f}, rod_m: {c.rod_m:.6f}, length_at_zero_m: "
            f"{c.retracted_m:.6f}, angle_offset_rad: {offset:.6f}, direction: {direction}, "
            f"corner: {corner}}}"
        )

    four_bar = (
        f"{{type: four_bar, base_m: {bucket.base_m:.6f}, rod_m: {bucket.rod_m:.6f}, "
        f"length_at_zero_m: {bucket.retracted_m:.6f}, rocker_offset_rad: {lk.ROCKER_OFFSET:.6f}, "
        f"ground_m: {lk.GROUND_M}, rocker_m: {lk.ROCKER_M}, coupler_m: {lk.COUPLER_M}, "
        f"follower_m: {lk.FOLLOWER_M}, angle_offset_rad: "
        f"{lk.GROUND_ANGLE - lk.EAR_ANGLE:.6f}, direction: -1}}"
    )
    strokes = np.linspace(-0.06, bucket.stroke_m + 0.06, 55)
    angles = ", ".join(f"{lk.coupler_angle(q):.5f}" for q in strokes)
    table = (
        f"{{type: table, actuator: [{', '.join(f'{q:.2f}' for q in strokes)}], joint: [{angles}]}}"
    )
    lines = {
        "boom_joint": cylinder(boom, "pivot", boom.base_angle - boom.rod_angle, 1),
        "stick_joint": cylinder(stick, "pivot", stick.base_angle - stick.rod_angle, -1),
        "bucket_joint": four_bar,
        "boom_barrel_joint": cylinder(boom, "base", lk.wrap(boom.base_angle + pi), -1),
        "stick_rod_joint": cylinder(stick, "rod", lk.wrap(stick.rod_angle + pi), -1),
        "rocker_joint": cylinder(bucket, "pivot", bucket.base_angle, -1),
        "bucket_rod_joint": cylinder(bucket, "rod", pi, -1),
        "coupler_joint": table,
    }
    return [f"{joint}: {drive}" for joint, drive in lines.items()]
