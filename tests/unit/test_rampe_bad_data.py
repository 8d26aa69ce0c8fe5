"""Bad primitives in the stream of a learned operator: refused for their reason, learned never."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pytest

from rampe_guard.core.rampe import Rampe
from rampe_guard.core.types import Category, FloatArray

LIMITS = np.array([[-2.0, 2.0], [0.0, 1.0]])
HABITS: dict[Category, FloatArray] = {
    (1, 0): np.array([0.6, 0.0]),
    (-1, 0): np.array([-0.7, 0.0]),
    (0, 1): np.array([0.0, 0.3]),
    (1, -1): np.array([0.4, -0.2]),
}
UP: Category = (1, 0)
SCATTER = 0.08
"""Of the size of a displacement."""


@dataclass
class Operator:
    """Works in turn through his habits, each with its scatter; what is not driven creeps."""

    seed: int = 0
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)

    def start(self) -> FloatArray:
        return np.array([self.rng.uniform(-0.8, 0.8), self.rng.uniform(0.35, 0.6)])

    def primitive(self, category: Category) -> tuple[FloatArray, FloatArray]:
        x = HABITS[category] * (1.0 + SCATTER * self.rng.standard_normal(2))
        return self.start(), x + 0.002 * self.rng.standard_normal(2) * (x == 0.0)

    def work(self, rounds: int) -> Iterator[tuple[Category, FloatArray, FloatArray]]:
        for _ in range(rounds):
            for category in HABITS:
                yield category, *self.primitive(category)


def learned(limits: FloatArray | None, rounds: int = 20, seed: int = 0) -> tuple[Rampe, Operator]:
    model, operator = Rampe(2, limits=limits), Operator(seed)
    for category, q, x in operator.work(rounds):
        assert model.observe(category, q, x) is None
    return model, operator


def forecasts(model: Rampe) -> FloatArray:
    """Mean and scale of all habits from a few starts, those of an actuator it moves."""
    rows = []
    for category in HABITS:
        for q in ([-0.5, 0.4], [0.0, 0.5], [0.5, 0.55]):
            p = model.predict(category, q)
            assert p is not None
            rows.append(np.concatenate((p.mean, p.scale)))
    return np.array(rows)


known_or_not = pytest.mark.parametrize("limits", [LIMITS, None], ids=["limits", "unlimited"])


@known_or_not
@pytest.mark.parametrize(
    ("q", "x"),
    [
        ([np.nan, 0.5], [0.6, 0.0]),
        ([0.0, np.inf], [0.6, 0.0]),
        ([0.0, 0.5], [np.nan, 0.0]),
        ([0.0, 0.5], [0.6, -np.inf]),
    ],
)
def test_what_is_not_finite(
    limits: FloatArray | None, q: Sequence[float], x: Sequence[float]
) -> None:
    model, _ = learned(limits)
    before = forecasts(model)
    assert model.observe(UP, q, x) == "not_finite"
    assert model.refused == {"not_finite": 1}
    np.testing.assert_array_equal(forecasts(model), before)


def test_observations_beside_q_that_are_not_finite() -> None:
    model = Rampe(1, observations=1)
    model.observe((1,), [0.0], [1.0], [0.5])
    before = model.predict((1,), [0.0], [0.5])
    assert model.observe((1,), [0.0], [1.0], [np.nan]) == "not_finite"
    after = model.predict((1,), [0.0], [0.5])
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(after.mean, before.mean)
    assert model.predict((1,), [0.0], [np.inf]) is None


@known_or_not
def test_a_few_taps_are_as_real_as_any_primitive(limits: FloatArray | None) -> None:
    """One primitive of 10 did not move: learned (or set aside), and none is a frozen sensor.

    The mean of 0.6 falls by less than a fifth over 8 operators, and nowhere by half.
    """
    falls = []
    for seed in range(8):
        model, operator = learned(limits, seed=seed)
        before = forecasts(model)
        for _ in range(3):
            model.observe(UP, operator.start(), np.zeros(2))
            for category, q, x in operator.work(4):
                assert model.observe(category, q, x) is None
        assert set(model.refused) <= {"outlier"}
        after = forecasts(model)
        falls.append(np.abs(after - before)[:3, 0])
        np.testing.assert_allclose(after[3:, :2], before[3:, :2], atol=0.1)
    assert np.mean(falls) < 0.12
    assert np.max(falls) < 0.3


@known_or_not
def test_taps_of_who_taps_often_are_learned(limits: FloatArray | None) -> None:
    """Every third primitive of his is a tap: no bad data, but what he does."""
    model, operator = Rampe(2, limits=limits), Operator()
    for k in range(90):
        category, q, x = next(operator.work(1))
        tap = k % 3 == 0
        model.observe(category, q, np.zeros(2) if tap else x)
    assert sum(model.refused.values()) <= 2
    p = model.predict(UP, [0.0, 0.5])
    assert p is not None
    assert 0.33 < p.mean[0] < 0.47
    assert p.quantile(0.2)[0] < 0.15
    assert p.quantile(0.8)[0] > 0.5


@known_or_not
def test_a_frozen_sensor_is_no_operator_who_taps(limits: FloatArray | None) -> None:
    """Nothing moves in 40 primitives in a row: all refused, and not a bit changes."""
    model, operator = learned(limits)
    before = forecasts(model)
    stuck = operator.start()
    answers = [
        model.observe(category, stuck, np.zeros(2))
        for _, category in zip(range(40), [*HABITS] * 10, strict=True)
    ]
    assert answers == [None, None, *["no_motion"] * 38]
    assert model.refused == {"no_motion": 40}
    np.testing.assert_array_equal(forecasts(model), before)
    for category, q, x in operator.work(1):
        assert model.observe(category, q, x) is None


@known_or_not
def test_a_single_outlier_is_set_aside(limits: FloatArray | None) -> None:
    """Twice as far as ever: within the limits, and nothing like what he does."""
    model, operator = learned(limits)
    before = forecasts(model)
    assert model.observe(UP, [-1.0, 0.5], [2.5, 0.0]) == "outlier"
    assert model.refused == {"outlier": 1}
    np.testing.assert_array_equal(forecasts(model), before)
    for category, q, x in operator.work(5):
        assert model.observe(category, q, x) is None
    np.testing.assert_allclose(forecasts(model)[:, :2], before[:, :2], atol=0.05)


@known_or_not
def test_several_outliers_among_good_ones(limits: FloatArray | None) -> None:
    """One in five is wild, each another way: the model is the one that never met them."""
    model, operator = learned(limits)
    twin, _ = learned(limits)
    wild = [2.4, 1.9, 2.7, 2.1, 2.9]
    for far in wild:
        assert model.observe(UP, [-1.0, 0.5], [far, 0.0]) == "outlier"
        for category, q, x in operator.work(4):
            assert model.observe(category, q, x) is None
            assert twin.observe(category, q, x) is None
    assert model.refused == {"outlier": len(wild)}
    np.testing.assert_array_equal(forecasts(model), forecasts(twin))


@known_or_not
def test_two_outliers_alike_in_a_row_are_a_change_of_habit(limits: FloatArray | None) -> None:
    model, operator = learned(limits)
    assert model.observe(UP, [-1.0, 0.5], [2.4, 0.0]) == "outlier"
    assert model.observe(UP, [-1.0, 0.45], [2.5, 0.0]) is None
    assert model.refused == {"outlier": 1}
    for _ in range(4):
        q = [operator.rng.uniform(-1.2, -0.8), 0.5]
        assert model.observe(UP, q, np.array([2.45, 0.0])) is None
    p = model.predict(UP, [-1.0, 0.5])
    assert p is not None
    assert abs(p.mean[0] - 2.45) < 0.3
    other = model.predict((0, 1), [0.0, 0.5])
    assert other is not None
    assert abs(other.mean[1] - 0.3) < 0.03


@pytest.mark.parametrize(
    ("q", "x"),
    [([0.0, 0.5], [500.0, 0.0]), ([0.0, 0.5], [0.5, 40.0]), ([90.0, 0.5], [0.6, 0.0])],
    ids=["ends outside", "the other one ends outside", "begins outside"],
)
def test_beyond_the_limits(q: Sequence[float], x: Sequence[float]) -> None:
    model, _ = learned(LIMITS)
    before = forecasts(model)
    for _ in range(5):  # repeating it makes it no habit
        assert model.observe(UP, q, x) == "outside_limits"
    assert model.refused == {"outside_limits": 5}
    np.testing.assert_array_equal(forecasts(model), before)


def test_beyond_all_reason_without_limits() -> None:
    """A spike of a hundred times his longest, again and again: never a habit."""
    model, _ = learned(None)
    before = forecasts(model)
    for _ in range(5):
        assert model.observe(UP, [0.0, 0.5], [100.0, 0.0]) == "impossible"
    assert model.refused == {"impossible": 5}
    np.testing.assert_array_equal(forecasts(model), before)


def test_a_spike_as_the_very_first_primitive_without_limits() -> None:
    """Nothing is known yet, so it is learned; 40 good primitives later it hardly matters."""
    model, operator = Rampe(2), Operator()
    model.observe(UP, [0.0, 0.5], [100.0, 0.0])
    for category, q, x in operator.work(40):
        model.observe(category, q, x)
    p = model.predict(UP, [0.0, 0.5])
    assert p is not None
    assert abs(p.mean[0] - 0.6) < 0.12


@known_or_not
def test_swapped_columns(limits: FloatArray | None) -> None:
    """Actuator 1's data in actuator 2's place: what was driven stood still."""
    model, operator = learned(limits)
    before = forecasts(model)
    for _ in range(6):
        _, x = operator.primitive(UP)
        assert model.observe(UP, [0.1, 0.2], x[::-1]) == "wrong_actuator"
    assert model.refused == {"wrong_actuator": 6}
    np.testing.assert_array_equal(forecasts(model), before)


@known_or_not
@pytest.mark.parametrize("category", [(1, 0), (-1, 0), (1, -1)])
def test_motion_against_the_lever(limits: FloatArray | None, category: Category) -> None:
    """A wrong sign in the site file, or a load that pulls the arm down."""
    model, operator = learned(limits)
    before = forecasts(model)
    for _ in range(6):
        q, x = operator.primitive(category)
        assert model.observe(category, q, -x) == "against_lever"
    assert model.refused == {"against_lever": 6}
    np.testing.assert_array_equal(forecasts(model), before)


@known_or_not
def test_a_little_motion_against_the_lever_is_a_late_start(limits: FloatArray | None) -> None:
    """Lag: a hundredth of the range is no fault, and the mean never leads against Ω."""
    model = Rampe(2, limits=limits)
    for category, q, x in Operator().work(3):
        model.observe(category, q, x)
    for _ in range(12):
        model.observe((0, -1), [0.0, 0.5], [0.0, 0.005])
    p = model.predict((0, -1), [0.0, 0.5])
    assert p is not None
    assert p.occurrences > 0
    assert p.mean[1] <= 0.0


@known_or_not
def test_all_faults_in_one_stream(limits: FloatArray | None) -> None:
    """A fifth of the primitives is bad, of all kinds: the forecast is that of the good ones.

    Within 0.04 [unit] of a model that never saw a bad one, and each counted under its reason.
    """
    clean, dirty, operator = Rampe(2, limits=limits), Rampe(2, limits=limits), Operator(5)
    far = "outside_limits" if limits is not None else "impossible"
    faults: list[tuple[npt.ArrayLike, npt.ArrayLike, str]] = [
        ([0.0, np.nan], [0.6, 0.0], "not_finite"),
        ([0.0, 0.5], [300.0, 0.0], far),
        ([0.0, 0.5], [-0.9, 0.0], "against_lever"),
        ([0.1, 0.5], [0.0, 0.4], "wrong_actuator"),
        ([-1.2, 0.5], [2.9, 0.0], "outlier"),
    ]
    counts: dict[str, int] = {}
    for k, (category, q, x) in enumerate(operator.work(60)):
        clean.observe(category, q, x)
        dirty.observe(category, q, x)
        if k > 60 and k % 4 == 0:
            bad_q, bad_x, reason = faults[(k // 4) % len(faults)]
            assert dirty.observe(UP, bad_q, bad_x) == reason
            counts[reason] = counts.get(reason, 0) + 1
    assert dirty.refused == counts
    assert sum(counts.values()) > 40
    np.testing.assert_allclose(forecasts(dirty), forecasts(clean), atol=0.04)
