"""Predict first, then learn: errors that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.forecasters import Forecaster, RunningMean, Zero
from rampe_guard.evaluate.prediction_score import errors, known, learning_curve, ratio
from rampe_guard.evaluate.prequential import Trials, prequential
from rampe_guard.evaluate.segments import Segment
from tests.support.primitives import primitive

WIDTH = np.array([2.0, 0.5])
SWING, BOOM = (1, 0), (0, -1)


def team() -> dict[str, Forecaster]:
    return {"zero": Zero(), "mean": RunningMean()}


def swings(*lengths: float) -> list[Segment]:
    return [primitive(SWING, [0.0, 0.0], [x, 0.0]) for x in lengths]


def test_the_running_mean_is_that_of_the_primitives_before() -> None:
    lengths = [0.4, 0.8, 0.6, 1.0]
    trials = prequential([swings(*lengths)], team, fresh=False)
    assert trials.predicted[1, :, 0] == pytest.approx([0.0, 0.4, 0.6, 0.6])
    assert trials.answered.tolist() == [[True] * 4, [False, True, True, True]]
    assert trials.seen.tolist() == [0, 1, 2, 3]
    assert trials.truth[:, 0].tolist() == lengths


def test_knowledge_is_carried_from_run_to_run_or_not() -> None:
    runs = [swings(0.4, 0.8), swings(1.0, 0.2)]
    carried = prequential(runs, team, fresh=False)
    assert carried.predicted[1, :, 0] == pytest.approx([0.0, 0.4, 0.6, 2.2 / 3])
    assert carried.seen.tolist() == [0, 1, 2, 3]
    fresh = prequential(runs, team, fresh=True)
    assert fresh.predicted[1, :, 0] == pytest.approx([0.0, 0.4, 0.0, 1.0])
    assert fresh.seen.tolist() == [0, 1, 0, 1]
    assert carried.run.tolist() == fresh.run.tolist() == [0, 0, 1, 1]


def test_a_run_without_primitives_is_no_error() -> None:
    trials = prequential([[], swings(0.4, 0.8), []], team, fresh=True)
    assert trials.run.tolist() == [1, 1]


def mixed() -> Trials:
    segments = [
        primitive(SWING, [0.0, 0.0], [1.0, 0.0]),
        primitive(BOOM, [0.0, 0.0], [0.2, -0.25]),  # the swing coasts
        primitive(SWING, [0.0, 0.0], [0.5, 0.05]),
    ]
    return prequential([segments], team, fresh=False)


def test_errors_are_in_units_of_the_range() -> None:
    found = errors(mixed(), WIDTH, np.array([True, True, True]))
    # shares of the range: (0.5, 0), (0.1, -0.5), (0.25, 0.1)
    swing, boom = 0.25 + 0.01 + 0.0625, 0.25 + 0.01
    zero = found["zero"]
    assert zero.error == pytest.approx(np.sqrt((swing + boom) / 3))
    assert zero.actuators == pytest.approx(np.sqrt([swing / 3, boom / 3]))
    assert zero.moving == pytest.approx(np.sqrt((0.25 + 0.25 + 0.0625) / 3))
    assert zero.answered == 1.0
    mean = found["mean"]
    # said (0, 0), (0, 0) and (1.0, 0)
    assert mean.error == pytest.approx(np.sqrt((swing + boom) / 3))
    assert mean.answered == pytest.approx(1 / 3)


def test_only_the_chosen_primitives_count() -> None:
    found = errors(mixed(), WIDTH, np.array([False, True, False]))
    assert found["zero"].error == pytest.approx(np.sqrt(0.26))
    # of one primitive there is but one resample
    assert found["zero"].spread.low == found["zero"].spread.high == found["zero"].error
    assert errors(mixed(), WIDTH, np.array([False, False, False])) == {}


def test_known_means_seen_five_times_before() -> None:
    trials = prequential([swings(*[0.5] * 8)], team, fresh=False)
    assert known(trials).tolist() == [False] * 5 + [True] * 3


def test_learning_curve_bins_by_occurrences_before() -> None:
    trials = prequential([swings(*[0.5] * 7)], team, fresh=False)
    curve = learning_curve(trials, WIDTH)
    assert [(p.first, p.last, p.primitives) for p in curve] == [
        (0, 0, 1),
        (1, 1, 1),
        (2, 2, 1),
        (3, 4, 2),
        (5, 9, 2),
    ]
    assert [p.errors["zero"] for p in curve] == pytest.approx([0.25] * 5)
    assert [p.errors["mean"] for p in curve] == pytest.approx([0.25, 0, 0, 0, 0], abs=1e-12)


def noisy(scale: FloatArray, count: int = 400) -> Trials:
    """Forecasters "a", "b" whose errors are normal with the given deviations."""
    rng = np.random.default_rng(5)
    predicted = rng.standard_normal((2, count, 1)) * scale[:, None, None]
    return Trials(
        names=("a", "b"),
        run=np.zeros(count, dtype=np.int64),
        seen=np.arange(count),
        sign=np.ones((count, 1), dtype=np.int64),
        truth=np.zeros((count, 1)),
        predicted=predicted,
        answered=np.ones((2, count), dtype=np.bool_),
    )


def test_the_bootstrap_is_as_wide_as_theory_says() -> None:
    trials = noisy(np.array([0.1, 0.2]))
    everything = np.ones(400, dtype=np.bool_)
    spread = errors(trials, np.ones(1), everything)["a"].spread
    # the root mean square of N normal errors has 1 / sqrt(2 N) of their deviation
    assert (spread.high - spread.low) / 2 == pytest.approx(1.96 * 0.1 / np.sqrt(800), rel=0.2)
    assert spread.low < 0.1 < spread.high
    between = ratio(trials, np.ones(1), everything, "a", "b")
    assert between.low < 0.5 < between.high
    assert (between.high - between.low) / 2 == pytest.approx(1.96 * 0.5 * np.sqrt(2 / 800), rel=0.2)


def test_a_ratio_is_of_the_same_primitives() -> None:
    trials = noisy(np.array([0.1, 0.2]))
    everything = np.ones(400, dtype=np.bool_)
    with_itself = ratio(trials, np.ones(1), everything, "a", "a")
    assert (with_itself.low, with_itself.high) == (1.0, 1.0)


def test_there_is_no_ratio_to_who_is_never_wrong() -> None:
    trials = noisy(np.array([0.1, 0.0]))
    never = ratio(trials, np.ones(1), np.ones(400, dtype=np.bool_), "a", "b")
    assert np.isnan([never.low, never.median, never.high]).all()
