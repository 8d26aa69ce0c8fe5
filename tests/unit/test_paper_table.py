"""The table's figures against the same figures computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.evaluate.paper_estimates import Run
from rampe_guard.evaluate.paper_table import (
    category_rows,
    error_quantiles,
    rms,
    squared_shares,
)
from tests.support.paper import SPAN, made_run

A, B = (1, 1), (-1, 0)


def runs() -> list[Run]:
    rng = np.random.default_rng(1)
    made = []
    for seed in (1, 2):
        category = [A, B] * 3 + [A] * 14
        x = rng.normal([20.0, 0.1], [5.0, 0.05], (20, 2))
        said = x + rng.normal(0.0, [2.0, 0.01], (20, 2))
        made.append(made_run(category, rng.normal(size=(20, 2)), x, said, seed))
    return made


def test_a_row_per_category_from_the_primitives_themselves() -> None:
    made = runs()
    first, second = category_rows(made)
    assert (first.category, first.occurrences) == (A, 34)
    assert (second.category, second.occurrences) == (B, 6)
    of_a = [np.array([c == A for c in run.primitives.category]) for run in made]
    x = np.concatenate([r.primitives.displacement[a] for r, a in zip(made, of_a, strict=True)])
    assert first.rms_displacement == pytest.approx(np.sqrt((x**2).mean(axis=0)))
    known = [r.error("default")[a][3:] for r, a in zip(made, of_a, strict=True)]
    wanted = np.sqrt((np.concatenate(known) ** 2).mean(axis=0))
    assert first.rms_error["default"] == pytest.approx(wanted)
    last = np.concatenate([k[-10:] for k in known])
    assert len(last) == 20
    assert first.rms_last["default"] == pytest.approx(np.sqrt((last**2).mean(axis=0)))


def test_nothing_after_initialising_is_none_and_not_zero() -> None:
    row = category_rows(runs())[1]
    assert row.rms_error["faithful"] is None
    assert row.rms_last["faithful"] is None
    assert rms(np.zeros((0, 2))) is None


def test_quantiles_are_of_the_error_as_a_share_of_the_range() -> None:
    x = np.zeros((8, 2))
    said = np.outer(np.arange(8.0), SPAN)  # off by 0, 1, .. 7 ranges on both actuators
    run = made_run([A] * 8, np.zeros((8, 2)), x, said)
    every = error_quantiles([run], "default", SPAN, initialised=False)
    assert every.median == pytest.approx(3.5)
    assert every.count == 8
    known = error_quantiles([run], "default", SPAN, initialised=True)
    assert known.median == pytest.approx(5.0)
    assert known.count == 5
    assert known.p90 == pytest.approx(6.6)
    assert known.p99 == pytest.approx(6.96)
    assert known.largest == pytest.approx(7.0)


def test_no_primitives_have_no_quantiles() -> None:
    run = made_run([A], np.zeros((1, 2)), np.ones((1, 2)))
    found = error_quantiles([run], "faithful", SPAN, initialised=True)
    assert found.count == 0
    assert np.isnan(found.median)


def test_shares_of_the_squared_error_sum_to_one_the_worst_first() -> None:
    category = [A, B] * 5
    x = np.where(np.array([c == A for c in category])[:, None], SPAN, 2.0 * SPAN)
    run = made_run(category, np.zeros((10, 2)), x)
    assert squared_shares([run], "faithful", SPAN) == pytest.approx({B: 0.8, A: 0.2})
    assert next(iter(squared_shares([run], "faithful", SPAN))) == B
    right = made_run(category, np.zeros((10, 2)), x, x)
    assert squared_shares([right], "faithful", SPAN) == {}
