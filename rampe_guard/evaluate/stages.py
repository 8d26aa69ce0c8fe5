"""The work of one evaluation in pieces that can run in other processes, or on other machines.

Three lines of work know nothing of one another: the guard, the baselines (with the ground
truth), and the forecasts of the next displacement. The first two go through the logs in order
and hand on what was learned, so each of their pieces is a log. A piece gets values and gives
values; what it loads, it loads from files. The same pieces give the same values wherever they
run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits  # comes with scikit-learn

from rampe_guard.assembly import Machine
from rampe_guard.collision import Arm, FclSweeper, load_arm
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import LogError
from rampe_guard.evaluate.baselines import Raw, raw
from rampe_guard.evaluate.episodes import Contact
from rampe_guard.evaluate.guard_trace import GuardRun, guard_trace
from rampe_guard.evaluate.guard_trace import Knowledge as GuardKnowledge
from rampe_guard.evaluate.prediction import Prediction, assess
from rampe_guard.evaluate.referee import LEAVE_LIMIT, Referee
from rampe_guard.evaluate.segments import cut
from rampe_guard.evaluate.touch import Touch
from rampe_guard.evaluate.walk import Knowledge, Walker
from rampe_guard.recording import open_log
from rampe_guard.settings import load_site

_REACH_SAMPLES = 50


@dataclass(frozen=True, slots=True)
class Piece:
    """A log of a sequence, and how it is to be taken.

    Attributes:
        site: path of the site file.
        log: path of the log.
        learn: whether it teaches.
    """

    site: str
    log: str
    learn: bool


@dataclass(frozen=True, slots=True)
class Work:
    """What truly happened in one log, and what the baselines are made of.

    Attributes:
        name: of the log, without its folder.
        window: first and last position [s].
        contacts: of all zones.
        raw: of the baselines.
        low: smallest position of each actuator (n,) [unit].
        high: the greatest (n,) [unit].
        reach_m: farthest that any point of the arm was from the root frame's origin [m].
        warnings: what was wrong with the log.
        knowledge: what the baselines know in the end.
    """

    name: str
    window: tuple[float, float]
    contacts: tuple[Contact, ...]
    raw: Raw
    low: FloatArray
    high: FloatArray
    reach_m: float
    warnings: tuple[str, ...]
    knowledge: Knowledge


@lru_cache(maxsize=4)
def _arm(site: str, content: bytes) -> Arm:  # noqa: ARG001 - the key
    return load_arm(load_site(site).arm)


def machine_of(site: str) -> Machine:
    """The machine of a site file; its arm is loaded once while the file stays as it is.

    The sweeper is new each time: what one has swept before shows in the last bits of what it
    says next, and a piece must give the same wherever it runs.
    """
    loaded = load_site(site)
    arm = _arm(site, Path(loaded.path).read_bytes())
    sweeper = FclSweeper(arm, loaded.scene, loaded.sweep, loaded.self_collision)
    return Machine(loaded, arm, sweeper)


def judged_zones(machine: Machine) -> tuple[str, ...]:
    """Zones that can be judged: where an object that moves truly was, nobody knows."""
    moving = {item.name for item in machine.site.scene.moving}
    return tuple(name for name in machine.sweeper.zones if name not in moving)


def guard_piece(piece: Piece, knowledge: GuardKnowledge | None) -> GuardRun:
    """One log through the guard."""
    machine = machine_of(piece.site)
    log = open_log(machine.site, piece.log, machine.arm.limits)
    zones = judged_zones(machine)
    return guard_trace(machine, log, log.first_s, zones, knowledge, learn=piece.learn)


def work_piece(piece: Piece, knowledge: Knowledge | None) -> Work:
    """Ground truth and baselines of one log.

    Raises:
        LogError: the guard could not see at any time of it.
    """
    machine = machine_of(piece.site)
    log = open_log(machine.site, piece.log, machine.arm.limits)
    touch = Touch(machine.sweeper, judged_zones(machine))
    samples = list(log.positions())
    positions = np.array([q for _, q in samples])
    referee = Referee(machine.sweeper, touch.zones)
    for (time_s, q), asked in zip(samples, touch.near(positions, LEAVE_LIMIT), strict=True):
        referee.feed(time_s, q, asked)
    walker = Walker(
        machine.site.guard,
        machine.arm.limits,
        log.first_s,
        replace(knowledge) if knowledge else Knowledge(),
        learn=piece.learn,
    )
    moments = walker.follow(log.steps())
    if not moments:
        raise LogError(f"{piece.log}: at no time were both inputs there; nothing to evaluate")
    return Work(
        name=Path(piece.log).name,
        window=(samples[0][0], samples[-1][0]),
        contacts=referee.contacts,
        raw=raw(moments, touch, machine.arm.limits),
        low=positions.min(axis=0),
        high=positions.max(axis=0),
        reach_m=_reach(machine, positions),
        warnings=tuple(log.warnings),
        knowledge=walker.knowledge,
    )


def prediction_piece(
    site: str, logs: tuple[str, ...], fresh: bool, frozen: int | None
) -> Prediction:
    """Forecasts of the next displacement, over all logs.

    Raises:
        LogError: there is no primitive to predict.
    """
    machine = machine_of(site)
    config, limits = machine.site.guard, machine.arm.limits
    runs = [cut(config, limits, open_log(machine.site, log, limits)) for log in logs]
    with threadpool_limits(1):  # the same bits however many cores there are
        return assess(config, limits, runs, fresh=fresh, frozen=frozen)


def _reach(machine: Machine, positions: FloatArray) -> float:
    """Farthest vertex of any link, seen from the foot of the arm, over some positions [m]."""
    some = positions[:: max(1, len(positions) // _REACH_SAMPLES)]
    poses = machine.sweeper.link_poses(some)  # (k, L, 4, 4)
    foot = poses[:, 0, :3, 3]
    farthest = 0.0
    for link, mesh in enumerate(machine.arm.meshes):
        if mesh is not None:
            rotation, origin = poses[:, link, :3, :3], poses[:, link, :3, 3]
            points = np.einsum("kij,vj->kvi", rotation, mesh.vertices) + (origin - foot)[:, None]
            farthest = max(farthest, float(np.linalg.norm(points, axis=2).max()))
    return farthest
