"""Logs to primitives: the very ones that the guard learns from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.config import ActuatorConfig, GuardConfig, Observation, RampeConfig
from rampe_guard.core.events import PredictionEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.types import FloatArray, Placement, SweepResult
from rampe_guard.errors import LogError
from rampe_guard.evaluate.forecasters import SiteRampe
from rampe_guard.evaluate.prediction import assess
from rampe_guard.evaluate.segments import cut, position_middle, position_range
from rampe_guard.runtime.csv_log import CsvLog
from rampe_guard.runtime.replay import replay

LIMITS = np.array([[-3.0, 3.0], [0.0, 1.0]])
CONFIG = GuardConfig(
    actuators=(
        ActuatorConfig("swing", 0, 1, 1.0, 4.0, 0.1, 0.05, "rad"),
        ActuatorConfig("boom", 1, 1, 0.5, 2.0, 0.1, 0.05, "m"),
    ),
    axes=2,
)


class Nowhere:
    """Geometry without anything to touch."""

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        del start, displacement, any_path, clearance, wider_m, only, placed
        return SweepResult(())


def log(strokes: list[tuple[float, float, float]], period_s: float = 0.05) -> CsvLog:
    """Levers held for (seconds, swing, boom), half a second of rest after each."""
    axes: list[tuple[float, float]] = []
    for seconds, swing, boom in strokes:
        axes += [(swing, boom)] * round(seconds / period_s)
        axes += [(0.0, 0.0)] * round(0.5 / period_s)
    u = np.array([(0.0, 0.0), *axes])
    speed = np.array([0.8, 0.3])
    q = np.array([0.0, 0.3]) + np.cumsum(u * speed * period_s, axis=0)
    time_s = np.array([period_s * k for k in range(len(u))])
    return CsvLog("folder/made.csv", time_s, u, q, ())


STROKES = [(1.0, 1.0, 0.0), (0.6, -1.0, 0.5), (0.8, 0.0, -0.5), (1.0, -1.0, 0.0), (0.6, 1.0, 0.0)]


def offered(made: CsvLog) -> list[tuple[tuple[int, ...], FloatArray, FloatArray]]:
    """(Ω, start, displacement) of each primitive that a guard gave its model to learn.

    The model may still refuse one as implausible; forecasters are asked about it all the same.
    """
    cut_short = {"incomplete", "inputs_refused", "too_short"}
    guard = Guard(CONFIG, LIMITS, Nowhere(), float(made.time_s[0]))
    return [
        (e.prediction.category, e.prediction.start, e.prediction.progress)
        for _, events in replay(guard, made)
        for e in events
        if isinstance(e, PredictionEvent) and e.event == "ended" and e.refusal not in cut_short
    ]


def same_as_the_guard(made: CsvLog) -> int:
    """How many primitives there are; each is what the guard learned."""
    ours, theirs = cut(CONFIG, LIMITS, made).segments, offered(made)
    assert [s.start.category for s in ours] == [category for category, _, _ in theirs]
    for segment, (_, start, displacement) in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(segment.start.q, start)
        np.testing.assert_array_equal(segment.displacement, displacement)
    return len(ours)


@pytest.mark.parametrize("observations", [("q",), ("q", "time", "command_sum", "speed")])
def test_the_sites_rampe_learns_what_the_guards_does(observations: tuple[Observation, ...]) -> None:
    config = replace(CONFIG, rampe=RampeConfig(observations=observations))
    made = log([(s + 0.05 * k, u, v) for k in range(4) for s, u, v in STROKES])
    guard = Guard(config, LIMITS, Nowhere(), float(made.time_s[0]))
    said = [
        e.prediction.mean
        for _, events in replay(guard, made)
        for e in events
        if isinstance(e, PredictionEvent) and e.event == "started"
    ]
    ours = SiteRampe(config, LIMITS)
    for segment, mean in zip(cut(config, LIMITS, made).segments, said, strict=True):
        np.testing.assert_array_equal(ours.predict(segment.start), mean)
        ours.observe(segment)
    theirs = guard.rampe.snapshot()
    for name, array in ours.model.snapshot().items():
        np.testing.assert_array_equal(array, theirs[name], err_msg=name)


def test_primitives_are_those_that_the_guard_learns() -> None:
    assert same_as_the_guard(log(STROKES)) == len(STROKES)


def test_a_silent_input_costs_the_primitive_here_as_in_the_guard() -> None:
    made = log(STROKES)
    time_s = made.time_s.copy()
    time_s[10:] += 0.7  # in the middle of the first stroke; the time-out is 0.5 s
    gap = CsvLog(made.path, time_s, made.axes, made.position, ("a row",))
    assert same_as_the_guard(gap) == len(STROKES) - 1
    run = cut(CONFIG, LIMITS, gap)
    assert (run.incomplete, run.left_out, run.refused) == (1, 1, 0)


def test_a_refused_sample_costs_the_primitive_and_not_the_range() -> None:
    made = log(STROKES)
    q = made.position.copy()
    q[12, 1] = 0.95  # too far to have gone in one sample
    spike = CsvLog(made.path, made.time_s, made.axes, q, ())
    assert same_as_the_guard(spike) == len(STROKES) - 1
    run = cut(CONFIG, LIMITS, spike)
    assert (run.incomplete, run.refused) == (1, 1)
    np.testing.assert_array_equal(position_range([run]), np.ptp(made.position, axis=0))


def test_a_sender_that_starts_anew_costs_no_later_primitive() -> None:
    made = log(STROKES)
    q = made.position.copy()
    q[45:, 0] += 1.5  # the swing was zeroed elsewhere: refused for the time-out, then taken up
    jump = CsvLog(made.path, made.time_s, made.axes, q, ())
    found = same_as_the_guard(jump)
    assert 0 < found < len(STROKES)
    assert cut(CONFIG, LIMITS, jump).refused > 1


def test_what_is_known_at_the_start_and_seen_on_the_way() -> None:
    first = cut(CONFIG, LIMITS, log(STROKES)).segments[0]
    assert first.start.category == (1, 0)
    assert first.displacement == pytest.approx([0.8, 0.0], abs=0.05)
    assert first.duration_s == pytest.approx(1.0, abs=0.2)  # the filter lets go late
    # the debounce lies between the start and its detection
    assert first.start.time_s - first.start_s >= CONFIG.joystick.debounce_s
    assert first.start.velocity[0] > 0.0
    assert first.start.command[0] > 0.5
    assert first.times_s[0] >= first.start.time_s
    assert (np.diff(first.times_s) > 0.0).all()
    shape = (len(first.times_s), 2)
    assert first.path.shape == first.velocities.shape == first.commands.shape == shape
    assert first.velocities[8] == pytest.approx([0.8, 0.0])
    assert first.commands[8, 0] == pytest.approx(1.0, abs=0.01)
    assert first.commands[-1, 0] < 0.2  # let go, and filtered
    # seen to the end, and through the debounce in which its end was not yet known
    assert first.times_s[-1] >= first.end_s


def test_range_and_middle_are_those_of_all_runs_together() -> None:
    runs = [cut(CONFIG, LIMITS, log([(s, 1.0, 0.0)])) for s in (0.5, 1.0)]
    assert position_range(runs) == pytest.approx([0.8, 1.0])  # the boom never moved: one unit
    assert position_middle(runs) == pytest.approx([0.4, 0.3])
    assert runs[0].name == "made.csv"
    assert runs[0].duration_s == pytest.approx(1.0)


def refusal(made: CsvLog) -> str:
    with pytest.raises(LogError) as caught:
        assess(CONFIG, LIMITS, [cut(CONFIG, LIMITS, made)], fresh=False)
    return str(caught.value)


def test_why_there_is_nothing_to_predict() -> None:
    assert "no lever was moved for 0.08 s" in refusal(log([]))
    slow = refusal(log(STROKES, period_s=0.6))
    assert "begun, and all cut short: inputs silent for longer than 0.5 s (12 in all" in slow
    assert "rows are 0.6 s apart" in slow
    assert "refused" not in slow
    made = log([(1.0, 1.0, 0.0)])
    q = made.position.copy()
    q[10, 1] = 0.95
    spike = refusal(CsvLog(made.path, made.time_s, made.axes, q, ()))
    assert "1 begun, and all cut short: refused samples (1 in all)" in spike
