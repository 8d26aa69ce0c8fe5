"""A program that gives the sweep, and FCL behind it, every pose that a message may bring.

FCL may take the process with it, so this is run as one of its own. The case in hand is written
to the file named first, so that whoever finds this process dead can see of what it died.

    python -m tests.support.pose_fuzz CASE.json EXAMPLES
"""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from rampe_guard import wire
from rampe_guard.collision import Arm, FclSweeper, load_arm
from rampe_guard.core.config import InputConfig
from rampe_guard.core.moving import MovingObjects
from rampe_guard.core.scene import Box, Capsule, Cylinder, Mesh, Scene, SolidObject, Sphere
from rampe_guard.core.types import Certificate, FloatArray, Inputs, SweepResult
from rampe_guard.errors import MessageError
from rampe_guard.runtime.batch import object_sample
from rampe_guard.settings import load_site
from tests.support.arms import fork_triangles, write_stl
from tests.support.processes import BENCH

FAR_M = 1e4
"""Further than any of these objects, grown or not, reaches from its frame."""
SMALL = (0.0, -0.0, 5e-324, 1e-300, 1e-12, 1e-9, 1e-7, 1e-3, 0.5, 1.0, 1.0 + 1e-15, np.pi / 2)
LARGE = (FAR_M, 99_999.0, 1e6, 1.0001e6, 1e300, np.inf, np.nan)
SPEEDS = (0.0, 1e-12, 8.0, 100.0)
AGE_S = 0.9
NUMBERS = st.sampled_from(SMALL + LARGE) | st.floats(-3.0, 3.0)
SIGNED = st.builds(lambda x, sign: x * sign, NUMBERS, st.sampled_from((1.0, -1.0)))


@st.composite
def messages(draw: st.DrawFn) -> dict[str, object]:
    """A pose as JSON has it: most of them sound, with rotations of both kinds."""
    message: dict[str, object] = {"stamp": 0.0, "xyz_m": draw(st.tuples(SIGNED, SIGNED, SIGNED))}
    if draw(st.booleans()):
        message["rpy_rad"] = draw(st.tuples(SIGNED, SIGNED, SIGNED))
    else:
        axis = np.array(draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4)))
        length = float(np.linalg.norm(axis))
        unit = axis / length if length > 0.0 else np.array([0.0, 0.0, 0.0, 1.0])
        # as far from a unit as senders round
        message["quaternion_xyzw"] = tuple(unit * draw(st.sampled_from((1.0, 1.0 + 9e-4, 0.9))))
    return message


def objects(mesh: Path, size: float, speed: float) -> list[SolidObject]:
    """One of each kind, all about their own origin."""
    one = np.eye(4)
    more: Any = {"margin_m": 0.1, "max_speed": speed}
    return [
        Box(name="box", key="k/box", size_m=(size, 0.3, 0.1 * size), pose=one, **more),
        Sphere(name="sphere", key="k/sphere", radius_m=size, center_m=(0.0, 0.0, 0.0), **more),
        Cylinder(name="cylinder", key="k/c", radius_m=0.2, height_m=size, pose=one, **more),
        Capsule(name="capsule", key="k/capsule", radius_m=0.1, start_m=(0.0, 0.0, 0.0),
                end_m=(size, 0.0, 0.0), **more),
        Mesh(name="mesh", key="k/mesh", file=str(mesh), scale=1.0, pose=one, **more),
    ]  # fmt: skip


class Trial:
    """Sweepers of one arm among objects of several sizes, and what must hold of all answers."""

    def __init__(self, arm: Arm, mesh: Path) -> None:
        self.sweepers = [
            (scene.moving, FclSweeper(arm, scene))
            for size in (1e-6, 0.4, 50.0)
            for speed in SPEEDS
            for scene in [Scene(tuple(objects(mesh, size, speed)))]
        ]
        self.start = arm.limits.mean(axis=1)
        self.way = 0.1 * (arm.limits[:, 1] - arm.limits[:, 0])
        link = max(i for i, m in enumerate(arm.meshes) if m is not None)
        pose = self.sweepers[0][1].link_poses(self.start[None])[0, link]
        vertices = arm.meshes[link].vertices  # type: ignore[union-attr]
        self.corner: FloatArray = pose[:3, :3] @ vertices[0] + pose[:3, 3]

    def run(self, which: int, message: wire.ObjectPose, *, onto_arm: bool) -> None:
        """Sweep with every object there (or with its origin on the arm), standing and moving."""
        moving_objects, sweeper = self.sweepers[which]
        if onto_arm:
            corner = tuple(self.corner.tolist())
            message = wire.ObjectPose(
                xyz_m=corner, rpy_rad=message.rpy_rad, quaternion_xyzw=message.quaternion_xyzw
            )
        moving = MovingObjects(moving_objects, InputConfig())
        samples = tuple(object_sample(item.name, message, 0.0) for item in moving_objects)
        _, refused = moving.take(Inputs(objects=samples), 0.0)
        assert not refused, refused  # what the wire takes, the core can use
        placed = moving.placements(AGE_S)
        assert all(where is not None for where in placed.values())
        far = float(np.linalg.norm(message.xyz_m)) > FAR_M
        for way in (self.way, np.zeros_like(self.way)):
            answers = sweeper.sweep(self.start, way, placed=placed)
            _judge(answers, far=far, onto_arm=onto_arm)


def _judge(answers: SweepResult, *, far: bool, onto_arm: bool) -> None:
    assert len(answers.zones) == 5
    for zone in answers.zones:
        if onto_arm and zone.zone != "mesh":  # its origin need not be inside
            assert zone.certificate is not Certificate.FREE, zone
        if far:
            assert zone.certificate is Certificate.FREE, zone
        numbers = [zone.contact_fraction, zone.clearance_m, zone.clearance_now_m]
        assert not any(x is not None and np.isnan(x) for x in numbers), zone


def main(case: Path, examples: int) -> None:
    """Try so many messages; print how many were let through and refused."""
    warnings.simplefilter("error")
    let_through = refused = 0
    mesh = write_stl(case.with_suffix(".stl"), fork_triangles())
    trial = Trial(load_arm(load_site(BENCH).arm), mesh)

    @seed(4)
    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(messages(), st.integers(0, len(trial.sweepers) - 1), st.booleans())
    def run(message: dict[str, object], which: int, onto_arm: bool) -> None:
        nonlocal let_through, refused
        text = json.dumps(message)
        try:
            decoded = wire.decode_object_pose(text.encode())
        except MessageError:
            refused += 1
            return
        let_through += 1
        case.write_text(f"{text} {which} {onto_arm}")
        trial.run(which, decoded, onto_arm=onto_arm)

    run()
    print(let_through, refused)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
