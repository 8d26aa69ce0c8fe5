"""Times of one peer, and how its answers compare with the truth."""

from __future__ import annotations

import gc
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.types import FloatArray
    from tests.benchmarks.peers.judge import Judge
    from tests.benchmarks.peers.registry import Entry
    from tests.benchmarks.peers.work import Peer, Work

Answers: TypeAlias = list[float | None]
WARM_S = 1.0
PASS_BUDGET_S = 3.0
MOST_PASSES = 7


@dataclass(frozen=True, slots=True)
class Row:
    """Figures of one peer on one work.

    Attributes:
        median_ms, p99_ms: over the motions, each at the best of the passes.
        contacts: motions called a contact.
        missed: contacts called free.
        false: contacts called where the exact clearance is above twice the tolerance.
        late: contacts called after the first sample in contact.
        latest_mm, earliest_mm: by how much motion, at most.
    """

    peer: str
    guarantee: str
    median_ms: float
    p99_ms: float
    contacts: int
    missed: int
    false: int
    late: int
    latest_mm: float
    earliest_mm: float

    @property
    def sound(self) -> bool:
        """Nothing missed and nothing late in this run."""
        return not (self.missed or self.late)


@dataclass(frozen=True, slots=True)
class Truth:
    """What is known of a work: first sample in contact of each motion, and its way in metres."""

    contacts: tuple[float | None, ...]
    ways: tuple[tuple[FloatArray, FloatArray], ...]


def truth_of(work: Work, judge: Judge, oracle: Peer) -> Truth:
    """Ask the oracle."""
    contacts = tuple(oracle.first_contact(number) for number in range(len(work.motions)))
    return Truth(contacts, tuple(judge.posing.way(motion) for motion in work.motions))


def row_of(
    entry: Entry, work: Work, judge: Judge, truth: Truth, timed: tuple[Answers, FloatArray]
) -> Row:
    """Compare a peer's answers with the truth."""
    answers, times = timed
    verdicts = [
        judge.verdict(motion, true, said, way)
        for motion, true, said, way in zip(
            work.motions, truth.contacts, answers, truth.ways, strict=True
        )
    ]
    late = [v.late_m for v in verdicts if v.late_m is not None]
    early = [v.early_m for v in verdicts if v.early_m is not None]
    return Row(
        peer=entry.name,
        guarantee=entry.guarantee,
        median_ms=float(np.median(times)),
        p99_ms=float(np.percentile(times, 99)),
        contacts=sum(answer is not None for answer in answers),
        missed=sum(v.missed for v in verdicts),
        false=sum(v.false for v in verdicts),
        late=len(late),
        latest_mm=1e3 * max(late, default=0.0),
        earliest_mm=1e3 * max(early, default=0.0),
    )


def race(peers: Sequence[Peer], count: int) -> list[tuple[Answers, FloatArray]]:
    """Of each peer its answers, and its times [ms]: the best of as many passes as time allows.

    Passes take turns, so that a slow minute of the machine hits everybody, and the least of
    several is the time that the work takes. It is processor time of all threads: other
    processes count for little, and on one core nobody gains by threads. Motions follow each
    other as they come, so nobody is asked the same twice in a row.
    """
    for peer in peers:
        _warm(peer, count)
    found: list[tuple[Answers, FloatArray]] = [
        ([None] * count, np.full(count, np.inf)) for _ in peers
    ]
    spent = [0.0] * len(peers)
    gc.collect()
    gc.disable()
    try:
        for _ in range(MOST_PASSES):
            for k, peer in enumerate(peers):
                if spent[k] < PASS_BUDGET_S:
                    spent[k] += _pass(peer, *found[k])
    finally:
        gc.enable()
    return found


def _warm(peer: Peer, count: int) -> None:
    """What is compiled, cached or built at first use shall be."""
    begin = perf_counter()
    for number in range(count):
        peer.first_contact(number)
        if perf_counter() - begin > WARM_S:
            break


def _pass(peer: Peer, answers: Answers, times: FloatArray) -> float:
    """All motions once; the time it took [s]."""
    begin = perf_counter()
    for number in range(len(times)):
        start = process_time()
        answers[number] = peer.first_contact(number)
        times[number] = min(times[number], 1e3 * (process_time() - start))
    return perf_counter() - begin
