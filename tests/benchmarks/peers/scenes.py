"""Random cluttered scenes: spheres, boxes and closed meshes over a slab of ground.

Meshes are of three sorts: a block of the form of an L (two convex parts), a convex rock, and a
knobbly rock that no few convex parts make up. Up to 100 objects fill the space round the arm;
more of them fill more space at the same density, as on a site that grows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from rampe_guard.core.scene import Box, Mesh, Sphere
from tests.benchmarks.peers.judge import Judge
from tests.benchmarks.peers.posing import Posing
from tests.benchmarks.peers.work import Item, Motion, Piece, Solid, Work

if TYPE_CHECKING:
    from pathlib import Path

    from rampe_guard.core.types import FloatArray, Point
    from tests.benchmarks.peers.work import Machine

Kind: TypeAlias = Literal["mixed", "spheres", "boxes", "meshes"]
KINDS: tuple[Kind, ...] = ("mixed", "spheres", "boxes", "meshes")
FULL = 100
"""Objects that fill the space round an arm; more of them fill more space."""
SIZES = (0.03, 0.12)
"""Least and largest half size of an object [reach of the arm]."""
MOST_TRIES = 200
POSTURES = 20
LEAST_CLEAR = 0.7
"""Share of random postures that an object must leave clear: none stands in base or shoulder."""


def build_work(
    machine: Machine, count: int, kind: Kind, segments: int, seed: int, folder: Path
) -> Work:
    """A scene of ``count`` objects and motions that begin clear of all of them."""
    rng = np.random.default_rng([seed, count, KINDS.index(kind)])
    items = [_ground(machine)]
    posing = Posing(machine)
    postures = [machine.draw(rng) for _ in range(POSTURES)]
    while len(items) < count:
        item = _object(rng, machine, kind, len(items), count, folder)
        judge = Judge(Work(machine, (item,), (), kind), posing)
        clear = sum(judge.starts_free(posture) for posture in postures)
        if clear >= LEAST_CLEAR * POSTURES:
            items.append(item)
    scene = Work(machine, tuple(items), (), kind)
    return Work(machine, scene.items, draw_motions(scene, rng, segments), kind)


def draw_motions(
    scene: Work, rng: np.random.Generator, segments: int, moving: int | None = None
) -> tuple[Motion, ...]:
    """Random motions whose start is free by more than the tolerance."""
    judge = Judge(scene)
    motions: list[Motion] = []
    for _ in range(segments * MOST_TRIES):
        motion = scene.machine.draw(rng, moving)
        if judge.starts_free(motion):
            motions.append(motion)
            if len(motions) == segments:
                return tuple(motions)
    raise ValueError(f"only {len(motions)} of {segments} motions start free; use fewer objects")


def _ground(machine: Machine) -> Item:
    """A slab under everything, so far below the base that starts can be clear of it."""
    below = max(0.01 * machine.reach_m, 4.0 * machine.tolerance_m)
    size = 8.0 * machine.reach_m
    thick = 0.2 * machine.reach_m
    pose = np.eye(4)
    pose[2, 3] = machine.floor_m - below - 0.5 * thick
    return box_item("ground", 0, np.array([size, size, thick]), pose)


def _object(
    rng: np.random.Generator, machine: Machine, kind: Kind, number: int, count: int, folder: Path
) -> Item:
    room = machine.room * machine.reach_m * max(count / FULL, 1.0) ** (1.0 / 3.0)
    while True:
        place = rng.uniform(-room, room, 3)
        if np.linalg.norm(place) <= room and place[2] > machine.floor_m:
            break
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.random(random_state=rng).as_matrix(), place
    half = machine.reach_m * float(rng.uniform(*SIZES))
    name = f"object-{number}"
    form = kind if kind != "mixed" else KINDS[1 + int(rng.integers(3))]
    if form == "spheres":
        return ball_item(name, number, half, place)
    if form == "boxes":
        return box_item(name, number, 2.0 * half * rng.uniform(0.4, 1.0, 3), pose)
    shape = int(rng.integers(3))
    if shape == 0:
        return _angle_block(name, number, half, pose, folder)
    rock = _rock(rng, half, knobbly=shape == 1)
    return mesh_item(name, number, rock, pose, folder, convex=shape == 2)


def ball_item(name: str, number: int, radius: float, center: FloatArray) -> Item:
    """A sphere; its triangles for those who know only triangles are as far in as out."""
    pose = np.eye(4)
    pose[:3, 3] = center
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = np.asarray(ball.vertices)
    normals = vertices[np.asarray(ball.faces)].mean(axis=1)
    vertices = vertices * (2.0 * radius / (1.0 + float(np.linalg.norm(normals, axis=1).min())))
    surface = Solid(vertices, np.asarray(ball.faces, dtype=np.int64))
    zone = Sphere(name=name, margin_m=0.0, radius_m=radius, center_m=_point(center))
    piece = Piece("ball", np.array([radius]), pose, surface, number)
    return Item(zone, surface, pose, (piece,))


def box_item(name: str, number: int, size: FloatArray, pose: FloatArray) -> Item:
    """A box."""
    surface = _box(size)
    zone = Box(name=name, margin_m=0.0, size_m=_point(size), pose=pose)
    return Item(zone, surface, pose, (Piece("box", size, pose, surface, number),))


def mesh_item(
    name: str, number: int, surface: Solid, pose: FloatArray, folder: Path, *, convex: bool
) -> Item:
    """A closed mesh, written to a file for ours; its hull for those who want convex shapes."""
    hull = surface.hull()
    size = 0.5 * np.ptp(hull.vertices, axis=0)
    piece = Piece("hull", size, pose, hull, number, exact=convex)
    return Item(_zone(name, surface, pose, folder), surface, pose, (piece,))


def _angle_block(name: str, number: int, half: float, pose: FloatArray, folder: Path) -> Item:
    """An L as one closed surface: a profile drawn out; in two boxes for who wants it convex."""
    full, thin = 2.0 * half, 0.6 * half
    profile = np.array([[0, 0], [full, 0], [full, thin], [thin, thin], [thin, full], [0, full]])
    profile = profile - half
    low = np.column_stack([profile, np.full(6, -half)])
    high = np.column_stack([profile, np.full(6, half)])
    i = np.arange(6)
    j = (i + 1) % 6
    walls = [np.column_stack([i, j, j + 6]), np.column_stack([i, j + 6, i + 6])]
    top = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    faces = np.concatenate([*walls, top[:, ::-1], top + 6])
    surface = Solid(np.concatenate([low, high]), faces.astype(np.int64))
    pieces = []
    for a, b in (((0, 0), (full, thin)), ((0, thin), (thin, full))):
        start, end = np.array(a) - half, np.array(b) - half
        where = np.eye(4)
        where[:2, 3] = 0.5 * (start + end)
        size = np.array([*(end - start), full])
        pieces.append(Piece("box", size, pose @ where, _box(size), number))
    return Item(_zone(name, surface, pose, folder), surface, pose, tuple(pieces))


def _rock(rng: np.random.Generator, half: float, *, knobbly: bool) -> Solid:
    """A ball of 320 or 1,280 triangles, its corners moved in and out."""
    ball = trimesh.creation.icosphere(subdivisions=3 if knobbly else 2)
    vertices = np.asarray(ball.vertices, dtype=float)
    stretch = half * rng.uniform(0.6, 1.0, 3)
    if not knobbly:
        return Solid(vertices * stretch, np.asarray(ball.faces, dtype=np.int64)).hull()
    waves = rng.normal(0.0, 4.0, (3, 6))
    depth = np.sin(vertices @ waves + rng.uniform(0.0, 6.0, 6)).mean(axis=1)
    depth = 0.8 + 0.5 * depth
    return Solid(vertices * depth[:, None] * stretch, np.asarray(ball.faces, dtype=np.int64))


def _box(size: FloatArray) -> Solid:
    box = trimesh.creation.box(size)
    return Solid(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int64))


def _zone(name: str, surface: Solid, pose: FloatArray, folder: Path) -> Mesh:
    path = folder / f"{name}.stl"
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    path.write_bytes(trimesh.exchange.stl.export_stl(mesh))
    return Mesh(name=name, margin_m=0.0, file=str(path), scale=1.0, pose=pose)


def _point(values: FloatArray) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z
