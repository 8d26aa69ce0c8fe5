"""Robots of others: does each load, how long does it take, and does another see the same contacts?

From the project's root, with what tests/benchmarks/robots-requirements.txt names (the first needs
only the robots)::

    python -m tests.benchmarks.robots --out deploy/docs/reference/robots.md   # the table
    python -m tests.benchmarks.robots --check                                 # the comparison

The table: every URDF of the package example-robot-data that has four movable joints in series, and
a private excavator where it is. ``load`` is what a guard does at its start: URDF, meshes, bounding
trees, a scene of boxes; without imports and compiling. Sweeps are of random motions of up to three
joints, up to 1 rad each: certificate and first contact with each box. All times are the
processor's for this process: other work beside it does not count.

The comparison: the same motions looked at every 5 mm by pinocchio and coal, on their own reading of
URDF and meshes. Exit code 1 if

    missed   they find a contact that the sweep calls free
    late     they find it earlier
    early    they measure more than twice the tolerance where the sweep calls contact
    loose    they measure less than the clearance that the sweep calls proven
    unknown  the sweep could not tell
    pose     a link is not within 1e-9 where they have it
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.collision.shape_cache import ENVIRONMENT
from rampe_guard.core.scene import Scene
from rampe_guard.core.types import Certificate
from rampe_guard.errors import GeometryError
from tests.support.machines import AbsentError
from tests.support.robots import IN_SERIES, Robot, named, private, public
from tests.support.robots_check import boxes_round, check, draw, free_motion, reach_of

CHECKED = (
    "panda_description/panda",
    "ur_description/ur5_robot",
    "xarm_description/xarm7",
    "kinova_description/kinova",
    "zx200",
)
POSE = 1e-9
SCENE_BOXES = 30
POSTURES = 10
MARK = "<!-- table -->"


@dataclass(frozen=True, slots=True)
class Row:
    """One robot; times of the processor [s]."""

    name: str
    joints: int = 0
    driven: int = 0
    triangles: int = 0
    cold: float = 0.0
    warm: float = 0.0
    sweeps: tuple[float, ...] = ()
    refused: str = ""

    def text(self) -> str:
        """A line of the table."""
        if self.refused:
            return f"| {self.name} | no: {self.refused} | | | | | |"
        median, most = (1e3 * float(np.quantile(self.sweeps, q)) for q in (0.5, 0.99))
        joints = (
            str(self.joints) if self.driven == self.joints else f"{self.driven} of {self.joints}"
        )
        return (
            f"| {self.name} | yes | {joints} | {self.triangles:,} | {self.cold:.1f} |"
            f" {self.warm:.1f} | {median:.2f} / {most:.1f} |"
        )


def measure(robot: Robot, motions: int) -> Row:
    """Load a robot twice, from nothing and from what was kept, and sweep it."""
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as kept:
        os.environ[ENVIRONMENT] = kept
        begin = time.process_time()
        arm = load_arm(robot.describe())
        read = time.process_time()
        scene = Scene(tuple(boxes_round(reach_of(arm), SCENE_BOXES, rng)))
        built = time.process_time()
        sweeper = FclSweeper(arm, scene)
        cold = time.process_time() - built + read - begin
        scene = mostly_free(sweeper, scene, rng)
        begin = time.process_time()
        sweeper = FclSweeper(load_arm(robot.describe()), scene)
        warm = time.process_time() - begin
    times: list[float] = []
    while len(times) < motions:
        motion = free_motion(sweeper, rng)
        if motion is None:
            break
        begin = time.process_time()
        sweeper.sweep(*motion, any_path=False, clearance=False)
        times.append(time.process_time() - begin)
    triangles = sum(len(mesh.faces) for mesh in arm.meshes if mesh is not None)
    return Row(
        robot.name, len(robot.joints()), len(robot.driven()), triangles, cold, warm,
        tuple(times) or (float("nan"),),
    )  # fmt: skip


def mostly_free(sweeper: FclSweeper, scene: Scene, rng: np.random.Generator) -> Scene:
    """Without the boxes in which the robot stands, or is most of the time."""
    met = np.zeros(len(scene.objects))
    for _ in range(POSTURES):
        q = draw(sweeper.arm, rng)
        zones = sweeper.sweep(q, np.zeros_like(q), any_path=False, clearance=False).zones
        met += [zone.certificate is not Certificate.FREE for zone in zones]
    pairs = zip(scene.objects, met, strict=True)
    return Scene(tuple(item for item, count in pairs if count <= 0.2 * POSTURES))


def rows(robots: list[Robot], motions: int) -> list[Row]:
    """A row for each that has an arm, or that says itself that it is none."""
    found = []
    for robot in robots:
        try:
            if not robot.is_arm():
                continue
            row = measure(robot, motions)
        except GeometryError as error:
            said = str(error).replace(str(robot.urdf), robot.urdf.name)
            row = Row(robot.name, refused=said.replace("|", "/")[:120])
        found.append(row)
        print(row.text(), flush=True)
    return found


def table(robots: list[Robot], options: argparse.Namespace) -> int:
    """Print the table, and put it into a page."""
    warm_up()
    head = (
        "| robot | loads | joints driven | triangles | load, first time [s] | again [s]"
        " | sweep, median / p99 [ms] |\n|---|---|---|---|---|---|---|"
    )
    print(head)
    found = rows(robots, options.motions)
    good = sum(not row.refused for row in found)
    print(f"{good} of {len(found)} robots with {IN_SERIES} movable joints in series load")
    if options.out is not None:
        page = options.out.read_text("utf-8")
        before, _, rest = page.partition(MARK)
        _, _, after = rest.partition(MARK)
        lines = "\n".join([MARK, "", head, *(row.text() for row in found), "", MARK])
        options.out.write_text(before + lines + after, "utf-8")
    return 0 if found else 1


def warm_up() -> None:
    """The sweep is compiled before anything is timed, and kept where it always is."""
    from tests.support.arms import six_axis  # noqa: PLC0415

    with tempfile.TemporaryDirectory() as folder:
        arm = load_arm(six_axis(Path(folder)))
        scene = Scene(tuple(boxes_round(1.0, 3, np.random.default_rng(0))))
        free_motion(FclSweeper(arm, scene), np.random.default_rng(0))


def compare(robots: list[Robot], options: argparse.Namespace) -> int:
    """Print what another finds; 1 if it finds otherwise."""
    print(
        "| robot | motions | zones touched | missed | late | early | loose | unknown"
        " | pose differs by | at the call, at most | motions/s |\n|" + "---|" * 11
    )
    wrong = 0
    for robot in robots:
        begin = time.perf_counter()
        found = check(robot, options.motions, options.boxes, options.seed)
        speed = found.motions / (time.perf_counter() - begin)
        print(
            f"| {robot.name} | {found.motions} | {found.contacts} | {found.missed} | {found.late}"
            f" | {found.early} | {found.loose} | {found.unknown} | {found.pose:.1e}"
            f" | {1e3 * found.early_m:.3f} mm | {speed:.1f} |",
            flush=True,
        )
        for story in found.stories[:5]:
            print(f"  {story}")
        wrong += found.faults + (found.pose > POSE)
    return 1 if wrong else 0


def main() -> int:
    """Print the table or the comparison."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", maxsplit=1)[0])
    parser.add_argument("--check", action="store_true", help="compare with pinocchio and coal")
    parser.add_argument("--robots", nargs="+", help="only these, such as ur_description/ur5_robot")
    parser.add_argument("--motions", type=int, default=200, help="of each robot")
    parser.add_argument("--boxes", type=int, default=SCENE_BOXES, help="in the scene of --check")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="page into which the table goes")
    options = parser.parse_args()
    try:
        if options.check:
            names = options.robots or CHECKED
            here = [name for name in names if name != "zx200" or private()]
            return compare([named(name) for name in here], options)
        chosen = [named(name) for name in options.robots or ()]
        return table(chosen or [*public(), *private()], options)
    except AbsentError as why:
        print(why, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
