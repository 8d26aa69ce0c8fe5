"""Conservative advancement on MuJoCo's `mj_geomDistance`: convex hulls and primitives.

Twice: with the loop in Python, as its users write it, and with the loop compiled too, the
function called straight from its library: what it would be in C.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.benchmarks.peers.jit import inlined
from tests.benchmarks.peers.posing import Posing, Tables, way_of
from tests.benchmarks.peers.walking import Cover, Walk, advance, begin, cover_of, new_walk

if TYPE_CHECKING:
    from collections.abc import Callable

    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.work import Piece, Solid, Work

# `mj_geomDistance` is told beyond which distance nothing matters, and then answers that: it has to
# be more than the tolerance, or far reads as near.
TIGHT = 1e-9
"""Tolerance of MuJoCo's GJK [m]; its own 1e-6 is no faster."""


class AdvancingMujoco:
    """The scene as fixed geoms, each link as a geom of a body that is put where it belongs."""

    def __init__(self, work: Work) -> None:
        posing = Posing(work.machine)
        self.model = _model(work)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, self.data)
        self.pieces = len(work.pieces)
        links = len(work.machine.links)
        # MuJoCo keeps meshes in their inertial frames: poses and covers have to follow
        offset = _poses(self.model.geom_pos[self.pieces :], self.model.geom_quat[self.pieces :])
        self.tables, self.cover = _reframed(posing.tables, cover_of(work), offset)
        self.walk = new_walk(posing, self.cover)._replace(
            rotations=self.data.geom_xmat[self.pieces :].reshape(links, 3, 3),
            translations=self.data.geom_xpos[self.pieces :],
        )
        self.ways = [way_of(motion) for motion in work.motions]
        self.tolerance = work.machine.tolerance_m

    def first_contact(self, number: int) -> float | None:
        """Step the pair that is certified least far until one is within the tolerance."""
        tables, walk, tolerance = self.tables, self.walk, self.tolerance
        model, data, first = self.model, self.data, self.pieces
        way = self.ways[number]
        count = begin(tables, self.cover, way, walk, tolerance)
        pair = advance(tables, way, walk, count, -1, 0.0)
        while pair >= 0:
            link, piece = int(walk.pairs[pair, 0]), int(walk.pairs[pair, 1])
            enough = float(walk.now[1]) + 2.0 * tolerance
            distance = mujoco.mj_geomDistance(model, data, first + link, piece, enough, None)
            if distance <= tolerance:
                return float(walk.now[0])
            pair = advance(tables, way, walk, count, pair, distance)
        return None


class CompiledMujoco(AdvancingMujoco):
    """The same with no Python between two distances."""

    def __init__(self, work: Work) -> None:
        super().__init__(work)
        self._sweep = _compiled_sweep()

    def first_contact(self, number: int) -> float | None:
        """One call for the whole sweep."""
        addresses = self.model._address, self.data._address
        found = self._sweep(
            *addresses,
            self.pieces,
            self.tables,
            self.cover,
            self.ways[number],
            self.walk,
            self.tolerance,
        )
        return None if found > 1.0 else float(found)


def _compiled_sweep() -> Callable[..., float]:
    library = next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))
    ask = ctypes.CDLL(str(library)).mj_geomDistance
    ask.argtypes = [
        ctypes.c_void_p,
        ctypes.c_void_p,
        ctypes.c_int,
        ctypes.c_int,
        ctypes.c_double,
        ctypes.c_void_p,
    ]
    ask.restype = ctypes.c_double

    def sweep(
        model: int,
        data: int,
        first: int,
        tables: Tables,
        cover: Cover,
        way: FloatArray,
        walk: Walk,
        tolerance: float,
    ) -> float:
        count = begin(tables, cover, way, walk, tolerance)
        pair = advance(tables, way, walk, count, -1, 0.0)
        while pair >= 0:
            link, piece = int(walk.pairs[pair, 0]), int(walk.pairs[pair, 1])
            distance = ask(model, data, first + link, piece, walk.now[1] + 2.0 * tolerance, 0)
            if distance <= tolerance:
                return float(walk.now[0])
            pair = advance(tables, way, walk, count, pair, distance)
        return 2.0

    return inlined(sweep)


def _model(work: Work) -> Any:
    """Pieces as geoms of the world, then one body with one geom for each link."""
    spec = mujoco.MjSpec()
    for number, piece in enumerate(work.pieces):
        geom = spec.worldbody.add_geom(pos=piece.pose[:3, 3], quat=_quaternion(piece.pose))
        _shape(spec, geom, piece, f"piece-{number}")
    for number, hull in enumerate(work.machine.hulls):
        body = spec.worldbody.add_body(name=f"link-{number}", mocap=True)
        _mesh(spec, body.add_geom(), hull, f"link-{number}")
    spec.option.ccd_tolerance = TIGHT
    return spec.compile()


def _shape(spec: Any, geom: Any, piece: Piece, name: str) -> None:
    if piece.kind == "ball":
        geom.type = mujoco.mjtGeom.mjGEOM_SPHERE
        geom.size = [float(piece.size[0]), 0.0, 0.0]
    elif piece.kind == "box":
        geom.type = mujoco.mjtGeom.mjGEOM_BOX
        geom.size = 0.5 * piece.size
    else:
        _mesh(spec, geom, piece.solid, name)


def _mesh(spec: Any, geom: Any, solid: Solid, name: str) -> None:
    mesh = spec.add_mesh(name=name)
    mesh.uservert = solid.vertices.astype(np.float32).ravel()
    mesh.userface = solid.faces.astype(np.int32).ravel()
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    geom.type = mujoco.mjtGeom.mjGEOM_MESH
    geom.meshname = name


def _quaternion(pose: FloatArray) -> FloatArray:
    return np.asarray(Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True))


def _poses(positions: FloatArray, quaternions: FloatArray) -> FloatArray:
    result = np.tile(np.eye(4), (len(positions), 1, 1))
    result[:, :3, :3] = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    result[:, :3, 3] = positions
    return result


def _reframed(tables: Tables, cover: Cover, offset: FloatArray) -> tuple[Tables, Cover]:
    """Links and covers in frames that are ``offset`` (L, 4, 4) from the links' own."""
    links, balls = tables.links.copy(), cover.balls.copy()
    for number, row in enumerate(links):
        row[1:] = (row[1:].reshape(3, 4) @ offset[number]).ravel()
    for ball in balls:
        back = np.linalg.inv(offset[int(ball[0])])
        ball[1:4] = back[:3, :3] @ ball[1:4] + back[:3, 3]
    return tables._replace(links=links), cover._replace(balls=balls)
