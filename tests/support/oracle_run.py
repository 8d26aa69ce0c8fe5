"""One batch of hard motions through the sweep and before the referee."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision import FclSweeper
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.scene import Scene
from rampe_guard.core.types import AnyPath, Certificate
from tests.support.compare import Referee
from tests.support.hard_cases import KINDS, PER_BATCH, make_batch
from tests.support.machines import NAMES
from tests.support.obstacles import Obstacle
from tests.support.staircases import judge_any_path

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rampe_guard.collision.urdf import Arm
    from rampe_guard.core.types import FloatArray
    from tests.support.compare import Verdict
    from tests.support.hard_cases import Machine

ANY_PATH_EVERY = 5
ANY_PATH_MOVING = 3


@dataclass(slots=True)
class Tally:
    """Figures of many motions; lengths in [m], times in [ms].

    Attributes:
        motions: swept, each forwards, backwards and without sharp clearances.
        touching: zones that truly touch on the way, among all verdicts.
        contacts: zones called contact.
        unlike: zones called otherwise backwards than forwards (right only near the tolerance).
        faults: broken promises by kind.
        answers: answers of ``any_path`` by kind.
        early, over, under: worst of `Verdict`; ``witness`` worst of `AnyVerdict`.
        times: of the sweeps forwards.
        stories: a line per fault, with the case.
    """

    motions: int = 0
    verdicts: int = 0
    touching: int = 0
    contacts: int = 0
    unlike: int = 0
    faults: dict[str, int] = field(default_factory=dict)
    answers: dict[str, int] = field(default_factory=dict)
    early: float = 0.0
    over: float = 0.0
    under: float = 0.0
    witness: float = 0.0
    times: list[float] = field(default_factory=list)
    stories: list[str] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Take in the figures of others."""
        self.motions += other.motions
        self.verdicts += other.verdicts
        self.touching += other.touching
        self.contacts += other.contacts
        self.unlike += other.unlike
        for mine, its in ((self.faults, other.faults), (self.answers, other.answers)):
            for kind, count in its.items():
                mine[kind] = mine.get(kind, 0) + count
        self.early = max(self.early, other.early)
        self.over = max(self.over, other.over)
        self.under = max(self.under, other.under)
        self.witness = max(self.witness, other.witness)
        self.times += other.times
        self.stories += other.stories

    def fault(self, kind: str, story: str) -> None:
        """Count a broken promise."""
        self.faults[kind] = self.faults.get(kind, 0) + 1
        self.stories.append(f"{kind}: {story}")

    def note(self, verdict: Verdict, where: str) -> None:
        """Count a verdict."""
        self.verdicts += 1
        self.touching += verdict.touches is True
        self.contacts += verdict.certificate is Certificate.CONTACT
        self.early = max(self.early, verdict.early_m or 0.0)
        self.over = max(self.over, verdict.over_m or 0.0)
        self.under = max(self.under, verdict.under_m or 0.0)
        for kind in verdict.faults:
            self.fault(kind, f"{where} {verdict.zone}: {verdict.detail}")


def kind_of(batch: int) -> str:
    """What a batch is made of."""
    return KINDS[batch % len(KINDS)]


def run_batch(
    machine: Machine,
    arm: Arm,
    seed: int,
    batch: int,
    folder: Path,
    *,
    only: int | None = None,
    motions: int = PER_BATCH,
    config: SweepConfig | None = None,
) -> Tally:
    """All motions of a batch (or one of them, counted through all batches), judged."""
    config = SweepConfig() if config is None else config
    rng = np.random.default_rng([seed, NAMES.index(machine.name), batch])
    made = make_batch(machine, kind_of(batch), rng, folder, motions)
    sweeper = FclSweeper(arm, Scene(made.items), config)
    obstacles = [Obstacle(item) for item in made.items]
    tally = Tally()
    for i, (start, displacement) in enumerate(made.motions):
        case = batch * PER_BATCH + i
        if only is not None and case != only:
            continue
        _one(tally, machine, sweeper, obstacles, config, start, displacement, case)
        if case % ANY_PATH_EVERY == 0:
            part = _fewer(displacement)
            result = sweeper.sweep(start, part, any_path=True)
            found = judge_any_path(
                machine.dense,
                obstacles,
                start,
                part,
                result,
                config,
                np.random.default_rng([seed, case]),
            )
            answer = found.answer or AnyPath.UNKNOWN
            tally.answers[answer.value] = tally.answers.get(answer.value, 0) + 1
            tally.witness = max(tally.witness, found.witness_m or 0.0)
            if found.fault:
                tally.fault("any_path", f"{machine.name} case {case}: {found.fault}")
    return tally


def batches(motions: int) -> Iterator[int]:
    """Numbers of the batches that hold so many motions."""
    yield from range(-(-motions // PER_BATCH))


def _one(
    tally: Tally,
    machine: Machine,
    sweeper: FclSweeper,
    obstacles: list[Obstacle],
    config: SweepConfig,
    start: FloatArray,
    displacement: FloatArray,
    case: int,
) -> None:
    end = start + displacement
    referee = Referee(machine.dense, obstacles, start, displacement, config)
    there = sweeper.sweep(start, displacement)
    back = sweeper.sweep(end, start - end)
    plain = sweeper.sweep(start, displacement, clearance=False)
    tally.motions += 1
    tally.times.append(there.elapsed_ms or 0.0)
    pairs = zip(there.zones, back.zones, strict=True)
    tally.unlike += sum(a.certificate is not b.certificate for a, b in pairs)
    where = f"{machine.name} case {case}"
    for verdict in referee.judge(there):
        tally.note(verdict, where)
    for verdict in referee.judge(back, backwards=True):
        tally.note(verdict, f"{where} backwards")
    for verdict in referee.judge(plain, sharp=False):
        tally.note(verdict, f"{where} without clearance")


def _fewer(displacement: FloatArray) -> FloatArray:
    """The motion of the ANY_PATH_MOVING actuators that move most in their units, halved."""
    part = np.zeros(len(displacement))
    most = np.argsort(-np.abs(displacement))[:ANY_PATH_MOVING]
    part[most] = 0.5 * displacement[most]
    return part
