"""Prequential evaluation: at every primitive each forecaster predicts first, then learns.

Nothing is ever predicted by a model that has seen it, no primitive is set aside, and how a
forecaster does while it knows little is part of the figure.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.forecasters import Forecaster
from rampe_guard.evaluate.segments import Segment

IntArray = npt.NDArray[np.int64]
Team = Mapping[str, Forecaster]


@dataclass(frozen=True, slots=True)
class Trials:
    """N primitives, each predicted by F forecasters, in the order in which they happened.

    Attributes:
        names: of the forecasters (F).
        run: index of the run (N,).
        seen: occurrences of the category before, as far as knowledge was carried (N,).
        sign: Ω (N, n).
        truth: displacement x (N, n) [unit].
        predicted: x̂ (F, N, n) [unit], zero where there was no forecast.
        answered: whether there was one (F, N).
    """

    names: tuple[str, ...]
    run: IntArray
    seen: IntArray
    sign: IntArray
    truth: FloatArray
    predicted: FloatArray
    answered: npt.NDArray[np.bool_]


def prequential(
    runs: Sequence[Sequence[Segment]],
    team: Callable[[], Team],
    *,
    fresh: bool,
    frozen: int | None = None,
) -> Trials:
    """Walk through all runs with a team of forecasters.

    Args:
        runs: primitives of each run, in order; at least one primitive in all.
        team: makes forecasters by name that know nothing yet.
        fresh: every run starts with a new team, instead of what the runs before it taught.
        frozen: only so many runs teach anything; None for all of them.
    """
    forecasters = team()
    seen: Counter[Category] = Counter()
    run, seen_before, predicted, answered = [], [], [], []
    for index, segments in enumerate(runs):
        if fresh and index:
            forecasters, seen = team(), Counter()
        for segment in segments:
            start = segment.start
            guesses = [f.predict(start) for f in forecasters.values()]
            run.append(index)
            seen_before.append(seen[start.category])
            answered.append([g is not None for g in guesses])
            predicted.append([np.zeros_like(start.q) if g is None else g for g in guesses])
            if frozen is None or index < frozen:
                for forecaster in forecasters.values():
                    forecaster.observe(segment)
                seen[start.category] += 1
    everything = [s for segments in runs for s in segments]
    return Trials(
        names=tuple(forecasters),
        run=np.array(run),
        seen=np.array(seen_before),
        sign=np.array([s.start.category for s in everything]),
        truth=np.array([s.displacement for s in everything]),
        predicted=np.array(predicted).transpose(1, 0, 2),
        answered=np.array(answered).T,
    )
