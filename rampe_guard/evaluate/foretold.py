"""Probabilities of contact within a horizon, and whether it came."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray
from rampe_guard.evaluate.blindness import NEVER
from rampe_guard.evaluate.judging import Truth
from rampe_guard.evaluate.points import block_count, block_of
from rampe_guard.evaluate.trace import Mask, Trace


def came(
    time_s: FloatArray,
    contacts: FloatArray,
    horizon_s: float,
    end_s: float,
    blind: FloatArray = NEVER,
) -> tuple[Mask, Mask]:
    """Whether the arm entered a zone within a horizon of each time, and whether that is known.

    Nothing is asked while the arm is in the zone, nor where the log ends, or the guard is blind,
    before the horizon: where inputs are missing, nobody knows what came.

    Args:
        time_s: when it is asked (k,) [s].
        contacts: entry and leaving (c, 2) [s], in order.
        horizon_s: how far ahead [s].
        end_s: end of the log [s].
        blind: spans in which the guard did not monitor (b, 2) [s].

    Returns:
        Whether it came (k,), and whether that can be judged (k,).
    """
    seen = time_s + horizon_s <= end_s
    if len(blind):
        next_s = np.append(blind[:, 0], np.inf)
        seen &= next_s[np.searchsorted(blind[:, 1], time_s, side="right")] > time_s + horizon_s
    if not len(contacts):
        return np.zeros(len(time_s), dtype=np.bool_), seen
    following = np.searchsorted(contacts[:, 0], time_s, side="right")
    entry = np.append(contacts[:, 0], np.inf)[following]
    inside = (following > 0) & (contacts[following - 1, 1] >= time_s)
    return entry <= time_s + horizon_s, ~inside & seen


def foretold(
    truths: Sequence[Truth], said: Sequence[Trace], horizon: int
) -> tuple[FloatArray, Mask, npt.NDArray[np.int64]]:
    """All answers of all logs and zones to one question: m probabilities, outcomes and blocks.

    Args:
        truths: what happened in each log.
        said: the traces of a forecaster, with horizons.
        horizon: index of the horizon.
    """
    probability: list[FloatArray] = [np.zeros(0)]
    outcome: list[Mask] = [np.zeros(0, dtype=np.bool_)]
    block: list[npt.NDArray[np.int64]] = [np.zeros(0, dtype=np.int64)]
    first = 0
    for truth, trace in zip(truths, said, strict=True):
        where = first + block_of(trace.time_s, truth.window)
        first += block_count(truth.window)
        for z, contacts in enumerate(truth.contacts):
            if trace.within is not None:
                horizon_s, end_s = trace.horizons_s[horizon], truth.window[1]
                it_came, known = came(trace.time_s, contacts, horizon_s, end_s, truth.blind)
                probability.append(trace.within[horizon, known, z])
                outcome.append(it_came[known])
                block.append(where[known])
    return np.concatenate(probability), np.concatenate(outcome), np.concatenate(block)
