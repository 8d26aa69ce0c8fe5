"""Verdicts come from the data: change the data and the verdict changes."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.paper_claims import Claim, Condition, Verdict, claims
from rampe_guard.evaluate.paper_estimates import N_INIT, Run
from rampe_guard.evaluate.paper_primitives import Primitives
from tests.support.paper import SPAN, made_primitives, two_blobs

COUNT = 40
NAN = float("nan")


def good_runs(count: int = 4) -> list[Run]:
    """Everything that the paper claims: nothing said thrice, then small errors that shrink."""
    return [_run(seed) for seed in range(count)]


def _run(seed: int) -> Run:
    rng = np.random.default_rng(seed)
    up, start, x = two_blobs(rng, COUNT)
    both = rng.normal([40.0, 2.9], [1.0, 0.01], (COUNT, 2))
    far = rng.normal([20.0, 0.15], [1.0, 0.01], (COUNT, 2))
    primitives = made_primitives(
        [*up, *[(1, 1)] * COUNT], np.concatenate([start, both]), np.concatenate([x, far])
    )
    k = primitives.occurrence
    noise = rng.normal(size=(2 * COUNT, 2)) * SPAN * (0.04 / np.sqrt(k))[:, None]
    said = np.where((k <= N_INIT)[:, None], 0.0, primitives.displacement + noise)
    return Run(
        seed,
        primitives,
        {"faithful": said, "default": said.copy(), "running mean": _mean(primitives)},
    )


def _mean(primitives: Primitives) -> FloatArray:
    said = np.zeros_like(primitives.displacement)
    for category in set(primitives.category):
        members = primitives.of(category)
        said[members] = primitives.displacement[members].mean(axis=0)
    return said


def verdicts(runs: list[Run]) -> list[Verdict]:
    return [c.verdict for c in claims(runs, "faithful", SPAN)]


def test_all_three_hold_where_all_is_as_the_paper_says() -> None:
    assert verdicts(good_runs()) == [Verdict.HOLDS] * 3


def test_errors_as_large_as_before_and_growing_are_told() -> None:
    runs = good_runs()
    for run in runs:
        k = run.primitives.occurrence[:, None]
        run.estimate["faithful"][:] = run.primitives.displacement + SPAN * 0.06 * k
    first, _, third = claims(runs, "faithful", SPAN)
    assert [c.met for c in first.conditions] == [False, False, True]
    assert first.verdict is Verdict.IN_PART
    assert third.verdict is Verdict.DOES_NOT


def test_an_error_of_zero_is_not_never_zero() -> None:
    runs = good_runs()
    for run in runs:
        run.estimate["faithful"][:] = run.primitives.displacement
    assert claims(runs, "faithful", SPAN)[0].conditions[2].met is False
    assert claims(runs, "default", SPAN)[0].conditions[2].met is True


def test_a_constant_does_not_separate_two_clusters() -> None:
    runs = good_runs()
    for run in runs:
        run.estimate["faithful"][:] = _mean(run.primitives) * 1.1
    second = claims(runs, "faithful", SPAN)[1]
    assert [c.met for c in second.conditions] == [True, False, False]
    assert second.conditions[1].values == pytest.approx(0.5)


def test_without_two_clusters_the_second_claim_is_not_shown() -> None:
    runs = good_runs()
    for run in runs:
        start = run.primitives.start
        start[:] = np.random.default_rng(1).normal([10.0, 2.8], [1.0, 0.01], start.shape)
    assert verdicts(runs)[1] is Verdict.NOT_SHOWN
    assert claims(runs, "faithful", SPAN)[1].conditions[0].met is False


def test_the_measured_numbers_are_those_of_the_definition() -> None:
    (run,) = runs = good_runs(1)
    known = run.initialised
    error, x = run.error("faithful")[known] / SPAN, run.primitives.displacement[known] / SPAN
    _, _, third = claims(runs, "faithful", SPAN)
    total, frequent, every = (c.values[0] for c in third.conditions)
    assert total == pytest.approx(np.abs(error).sum() / np.abs(x).sum())
    assert every == frequent == pytest.approx(np.sqrt((error**2).mean() / (x**2).mean()))
    fall = claims(runs, "faithful", SPAN)[0].conditions[1].values[0]
    of = [run.primitives.of(c)[N_INIT:] for c in set(run.primitives.category)]
    scaled = run.error("faithful") / SPAN
    first = np.concatenate([scaled[m[:10]] for m in of])
    last = np.concatenate([scaled[m[-10:]] for m in of])
    assert fall == pytest.approx(np.sqrt((last**2).mean() / (first**2).mean()))


@pytest.mark.parametrize(
    ("values", "above", "share", "met"),
    [
        ([1.0] * 9 + [3.0], False, 0.9, True),
        ([1.0] * 8 + [3.0] * 2, False, 0.8, False),
        ([2.0], False, 1.0, True),
        ([2.0], True, 0.0, False),
        ([3.0, NAN], True, 1.0, True),
        ([NAN], True, None, None),
    ],
)
def test_a_condition_is_met_when_nine_runs_of_ten_keep_its_limit(
    values: list[float], share: float | None, *, above: bool, met: bool | None
) -> None:
    condition = Condition("x", 2.0, above, np.array(values))
    assert condition.share == share
    assert condition.met is met


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ([0.0, 0.0], Verdict.HOLDS),
        ([0.0, 9.0], Verdict.IN_PART),
        ([9.0, 9.0], Verdict.DOES_NOT),
        ([0.0, NAN], Verdict.NOT_SHOWN),
    ],
)
def test_a_verdict_is_that_of_its_conditions(values: list[float], verdict: Verdict) -> None:
    conditions = tuple(Condition("x", 1.0, above=False, values=np.array([v])) for v in values)
    assert Claim("all is well", conditions).verdict is verdict
