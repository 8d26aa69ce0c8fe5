"""Coverage and reliability of forecasters whose calibration is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import stats
from scipy.special import stdtr, stdtrit

from rampe_guard.core.config import ActuatorConfig, GuardConfig
from rampe_guard.core.passing import UnderWay
from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.calibration import (
    AHEAD,
    Foretold,
    Odds,
    coverage,
    foretell,
    odds,
    reliability,
)
from rampe_guard.evaluate.forecasters import SiteRampe
from rampe_guard.evaluate.predictive import moments
from tests.support.primitives import primitive

WIDTH = np.array([2.0, 0.5])


@dataclass(frozen=True)
class Student:
    """|x_j| ~ t(dof, mean_j, scale_j) along the sign."""

    sign: FloatArray
    mean: FloatArray
    scale: FloatArray
    dof: float = 5.0

    def quantile(self, p: float) -> FloatArray:
        return self.sign * (self.mean + self.scale * float(stdtrit(self.dof, p)))

    def passing(
        self, distance: FloatArray, progress: FloatArray, under_way: UnderWay | None = None
    ) -> FloatArray:
        assert under_way is not None  # it is given, but this law does not need it
        there = np.asarray(stdtr(self.dof, (self.mean - distance) / self.scale), np.float64)
        here = np.asarray(stdtr(self.dof, (self.mean - progress) / self.scale), np.float64)
        return there / here


def drawn(count: int, wider: float = 1.0) -> list[Foretold]:
    """Primitives drawn from a t distribution, foretold by one ``wider`` times as wide.

    They move 0.1 of the range a sample, and the odds are asked on the way.
    """
    rng = np.random.default_rng(7)
    lengths = stats.t.rvs(5.0, 0.4, 0.1, size=count, random_state=rng)
    mean, scale = 0.4 * WIDTH, 0.1 * WIDTH
    told = []
    for k in range(count):
        category = ((1, 0), (0, -1))[k % 2]
        sign = np.array(category, dtype=np.float64)
        x = sign * lengths[k] * WIDTH
        way = np.arange(0.0, max(lengths[k], 0.05), 0.1)[:, None] * sign * WIDTH
        segment = primitive(category, [0.0, 0.0], x, duration_s=len(way) * 0.1, path=way.tolist())
        told.append(Foretold(segment, Student(sign, mean, wider * scale), k))
    return told


@pytest.mark.parametrize("level", [0.5, 0.9])
def test_intervals_of_the_true_law_cover_what_they_promise(level: float) -> None:
    found = coverage(drawn(2000), 2, level)
    assert found.counts.tolist() == [1000, 1000]
    three_sigma = 3 * np.sqrt(level * (1 - level) / 1000)
    assert found.actuators == pytest.approx([level, level], abs=three_sigma)
    assert found.overall == pytest.approx(found.actuators.mean())


def test_intervals_twice_too_narrow_cover_what_theory_says() -> None:
    found = coverage(drawn(2000, wider=0.5), 2, 0.9)
    expected = 2 * stats.t.cdf(0.5 * stats.t.ppf(0.95, 5), 5) - 1
    assert found.overall == pytest.approx(expected, abs=0.04)


def test_actuators_that_do_not_move_and_missing_forecasts_are_not_asked() -> None:
    sign = np.array([1.0, 0.0])
    told = [
        Foretold(primitive((1, 0), [0, 0], [0.8, 9.0]), Student(sign, 0.4 * WIDTH, WIDTH), 0),
        Foretold(primitive((1, 0), [0, 0], [9.0, 0.0]), None, 0),
    ]
    found = coverage(told, 2, 0.9)
    assert found.counts.tolist() == [1, 0]
    assert found.actuators[0] == found.overall == 1.0
    assert np.isnan(found.actuators[1])
    assert np.isnan(coverage([], 2, 0.9).overall)


def test_the_questions_of_a_primitive() -> None:
    path = [[0.0, 0.0], [0.1, 0.0], [0.2, 0.01], [0.3, 0.0]]
    times_s = [0.0, 0.05, 0.1, 0.25]  # the second is too near
    segment = primitive((1, 0), [0, 0], [0.5, 0.0], duration_s=0.3, path=path, times_s=times_s)
    law = Student(np.array([1.0, 0.0]), 0.4 * WIDTH, 0.1 * WIDTH)
    asked = odds([Foretold(segment, law, 0)], WIDTH, WIDTH)
    assert asked.actuator.tolist() == [0] * 15
    distances = [p + 2.0 * a for p in (0.0, 0.2, 0.3) for a in AHEAD]
    assert asked.passed.tolist() == [d <= 0.5 for d in distances]
    t = stats.t(5.0, 0.8, 0.2)
    expected = [t.sf(p + 2.0 * a) / t.sf(p) for p in (0.0, 0.2, 0.3) for a in AHEAD]
    assert asked.said == pytest.approx(expected)


def test_a_moment_is_what_the_guard_sees() -> None:
    path = [[0.1, 0.4], [0.2, 0.3], [0.3, 0.35]]
    plain = primitive((0, -1), [0, 0.4], [0.3, -0.05], path=path)
    lever = np.array([[0.2, -0.5], [0.0, -0.9], [-0.4, -0.3]])
    speed = np.array([[0.1, 0.0], [0.2, -0.2], [0.0, 0.1]])
    segment = replace(plain, commands=lever, velocities=speed)
    found = moments(segment, np.array([1.0, 0.4]))
    assert np.array([m.progress for m in found]) == pytest.approx(
        np.array([[0.0, 0.0], [0.0, 0.1], [0.0, 0.05]])
    )
    assert [m.under_way.command[1] for m in found] == [0.5, 0.9, 0.3]
    assert [m.under_way.peak[1] for m in found] == [0.5, 0.9, 0.9]
    assert [m.under_way.speed[1] for m in found] == pytest.approx([0.0, 0.5, 0.0])  # along Ω


def test_progress_counts_along_the_sign_and_never_below_zero() -> None:
    segment = primitive((0, -1), [0, 0.4], [0.0, -0.201], path=[[0, 0.45], [0, 0.3]])
    law = Student(np.array([0.0, -1.0]), 0.4 * WIDTH, 0.1 * WIDTH)
    asked = odds([Foretold(segment, law, 0)], WIDTH, WIDTH)
    t = stats.t(5.0, 0.2, 0.05)
    expected = [t.sf(p + 0.5 * a) / t.sf(p) for p in (0.0, 0.1) for a in AHEAD]
    assert asked.said == pytest.approx(expected)
    # 0.025, 0.05, 0.1, 0.15, 0.25 ahead of 0 and of 0.1, of 0.201 in all
    assert asked.passed.tolist() == [True] * 4 + [False] + [True] * 3 + [False] * 2


def test_the_true_law_is_reliable_and_a_too_wide_one_is_not() -> None:
    true = reliability(odds(drawn(2000), WIDTH, WIDTH))
    assert true.error < 0.02
    enough = true.counts > 200
    assert enough.sum() >= 5
    assert np.abs(true.said - true.happened)[enough].max() < 0.06
    assert reliability(odds(drawn(2000, wider=3.0), WIDTH, WIDTH)).error > 0.1


def test_no_forecast_no_answers_no_figure() -> None:
    none = odds([Foretold(primitive((1, 0), [0, 0], [1, 0], path=[[0, 0]]), None, 0)], WIDTH, WIDTH)
    found = reliability(none)
    assert found.counts.sum() == 0
    assert np.isnan(found.error)
    assert np.isnan(found.said).all()


def test_calibration_error_by_hand() -> None:
    said = np.array([0.05, 0.15, 0.15, 0.72, 0.78, 1.0])
    passed = np.array([False, True, False, True, True, True])
    found = reliability(Odds(np.array([0, 1, 1, 0, 0, 0]), said, passed, np.full(6, 9)))
    assert found.counts.tolist() == [1, 2, 0, 0, 0, 0, 0, 2, 0, 1]
    assert found.error == pytest.approx((0.05 + 2 * 0.35 + 2 * 0.25 + 0.0) / 6)
    assert found.happened[1] == 0.5
    assert found.said[7] == pytest.approx(0.75)
    only = reliability(Odds(np.array([0, 1]), said[:2], passed[:2], np.full(2, 9)).of(1))
    assert only.error == pytest.approx(0.85)


@pytest.mark.parametrize(("share", "error"), [(0.7, 0.0), (0.3, 0.4)])
def test_a_calibrated_and_a_miscalibrated_forecaster(share: float, error: float) -> None:
    passed = np.arange(1000) < 1000 * share
    found = reliability(
        Odds(
            np.zeros(1000, dtype=np.int64),
            np.full(1000, 0.7),
            passed,
            np.zeros(1000, dtype=np.int64),
        )
    )
    assert found.error == pytest.approx(error, abs=1e-9)


def test_foretelling_never_sees_the_primitive_itself() -> None:
    actuator = ActuatorConfig("swing", 0, 1, 1.0, 4.0, 0.1, 0.05, "rad")
    config, limits = GuardConfig((actuator,), axes=1), np.array([[-1.0, 1.0]])
    segments = [primitive((1,), [-0.5], [x]) for x in (0.3, 0.35, 0.28, 0.33, 0.31, 0.45)]

    def model() -> SiteRampe:
        return SiteRampe(config, limits)

    def median(told: Foretold) -> float:
        assert told.forecast is not None
        return float(told.forecast.quantile(0.5)[0])

    told = foretell([segments, segments], model, fresh=False)
    assert [t.seen for t in told] == list(range(12))
    assert median(told[6]) != median(told[5])
    alone = foretell([segments, segments], model, fresh=True)
    assert [t.seen for t in alone] == [*range(6), *range(6)]
    # the second run again, from nothing: what comes later in it does not matter
    assert [median(t) for t in alone if t.forecast] == [
        median(t) for t in told[:6] if t.forecast
    ] * 2
