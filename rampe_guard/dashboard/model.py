"""A machine as a page draws it: the meshes of its links, where they are, and its zones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rampe_guard.collision import Arm, load_arm
from rampe_guard.core.forecast import Forecaster
from rampe_guard.core.kinematics import ForwardKinematics
from rampe_guard.core.scene import ActuatorLimit, Scene
from rampe_guard.core.types import FloatArray
from rampe_guard.dashboard.solids import Solid, Triangles, solids
from rampe_guard.settings import Site

_SAMPLES = 64
_TAIL = 0.1
"""The stopping path does not depend on it."""


@dataclass(frozen=True)
class Model:
    """What does not change while a machine is watched.

    Attributes:
        site: of the machine.
        arm: its links, joints and limits.
        kinematics: of the arm.
        bodies: triangles per link in its own frame, None for a link without any (L,).
        moving: whether a link moves with any joint (L,).
        solids: keep-out objects with a body.
        limits: keep-out zones in actuator space.
        forecaster: of the stopping path.
        middle: of what the arm can reach [m].
        reach_m: how far from there it can get [m].
    """

    site: Site
    arm: Arm
    kinematics: ForwardKinematics
    bodies: tuple[Triangles | None, ...]
    moving: tuple[bool, ...]
    solids: tuple[Solid, ...]
    limits: tuple[ActuatorLimit, ...]
    forecaster: Forecaster
    middle: FloatArray
    reach_m: float

    def poses(self, position: FloatArray) -> FloatArray:
        """Poses of all links in the world (k, L, 4, 4) for positions (k, n) [unit].

        A position beyond what its linkage can do is drawn at the end of it.
        """
        return _poses(self.arm, self.kinematics, position)


def load_model(site: Site) -> Model:
    """Read the meshes of a site; nothing is compiled or wrapped, so it is quick.

    Raises:
        GeometryError: a URDF or mesh cannot be used.
    """
    arm = load_arm(site.arm)
    kinematics = ForwardKinematics(arm.chain)
    bodies = tuple(None if m is None else Triangles(m.vertices, m.faces) for m in arm.meshes)
    middle, reach_m = _reach(arm, kinematics, bodies)
    return Model(
        site=site,
        arm=arm,
        kinematics=kinematics,
        bodies=bodies,
        moving=tuple(frame > 0 for frame in arm.chain.link_frame),
        solids=solids(site.scene.objects, reach_m),
        limits=tuple(o for o in site.scene.objects if isinstance(o, ActuatorLimit)),
        forecaster=Forecaster(
            site.guard.actuators, arm.limits, site.guard.stopping.reaction_s, _TAIL
        ),
        middle=middle,
        reach_m=reach_m,
    )


def in_scene(model: Model, scene: Scene) -> Model:
    """The same machine among other objects.

    Raises:
        GeometryError: a mesh cannot be used.
    """
    return replace(
        model,
        site=replace(model.site, scene=scene),
        solids=solids(scene.objects, model.reach_m),
        limits=tuple(o for o in scene.objects if isinstance(o, ActuatorLimit)),
    )


def _poses(arm: Arm, kinematics: ForwardKinematics, position: FloatArray) -> FloatArray:
    inside = np.clip(position, arm.proven[:, 0], arm.proven[:, 1])
    joints = np.empty((len(position), len(arm.joints)))
    for column, joint in enumerate(arm.joints):
        joints[:, column] = joint.value(inside[:, joint.actuator])
    return kinematics.links(joints)


def _reach(
    arm: Arm, kinematics: ForwardKinematics, bodies: tuple[Triangles | None, ...]
) -> tuple[FloatArray, float]:
    """Middle of the arm's foot, and the farthest corner of any link from it in many postures."""
    low = np.where(np.isfinite(arm.limits[:, 0]), arm.limits[:, 0], -np.pi)
    high = np.where(np.isfinite(arm.limits[:, 1]), arm.limits[:, 1], np.pi)
    shares = np.random.default_rng(1).random((_SAMPLES, len(low)))
    poses = _poses(arm, kinematics, low + shares * (high - low))
    foot = np.asarray(arm.chain.link_origin[0][:3, 3], dtype=float)
    farthest = 0.0
    for link, body in enumerate(bodies):
        if body is None:
            continue
        ends = np.stack([body.vertices.min(axis=0), body.vertices.max(axis=0)])
        corners = np.array([[x, y, z] for x in ends[:, 0] for y in ends[:, 1] for z in ends[:, 2]])
        placed = corners @ poses[:, link, :3, :3].transpose(0, 2, 1) + poses[:, link, None, :3, 3]
        farthest = max(farthest, float(np.linalg.norm(placed - foot, axis=2).max()))
    return foot, farthest
