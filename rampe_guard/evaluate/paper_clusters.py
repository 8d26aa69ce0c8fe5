"""Two clusters in a category: of starts, which one linear model may tell apart; or of ends only.

The second is the limit that the paper itself names (Fig. 2): paths that are tangent where they
meet begin at one place in one category, and nothing in (q, Ω) says which of them is meant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.evaluate.paper_estimates import PredictorName, Run

SEPARATION = 4.0
"""Centres this many RMS distances apart make two clusters: an even spread cut in two has 3.46."""

ONE_PLACE = 2.0
"""Starts less than this many RMS distances apart are one place."""

LEAST_MEMBERS = 5
_ROUNDS = 50


@dataclass(frozen=True, slots=True)
class TwoClusters:
    """A category whose starts lie in two clusters that also went different ways.

    Attributes:
        category: Ω.
        members: index in the run of each of its primitives (N,).
        second: which of them belong to the second cluster (N,).
        starts: centres of the starts (2, n) [unit].
        displacements: mean displacements (2, n) [unit].
    """

    category: Category
    members: npt.NDArray[np.int64]
    second: npt.NDArray[np.bool_]
    starts: FloatArray
    displacements: FloatArray


def two_clusters(run: Run, category: Category, span: FloatArray) -> TwoClusters | None:
    """Find the two clusters of a category; None where there are not two.

    Two clusters means: of `LEAST_MEMBERS` each at least, with centres `SEPARATION` times as far
    apart as the RMS distance of a member from its centre, in starts; and mean displacements
    further apart than that RMS distance in displacements, since else nothing is to be told.

    Args:
        run: with its primitives.
        category: Ω.
        span: what counts as equally far on each actuator (n,) [unit].
    """
    members = run.primitives.of(category)
    if len(members) < 2 * LEAST_MEMBERS:
        return None
    q = run.primitives.start[members]
    x = run.primitives.displacement[members]
    second = _two_means(q / span)
    if min(second.sum(), (~second).sum()) < LEAST_MEMBERS:
        return None
    if _separation(q / span, second) < SEPARATION or _separation(x / span, second) < 1.0:
        return None
    return TwoClusters(category, members, second, _centres(q, second), _centres(x, second))


def two_ways(run: Run, category: Category, span: FloatArray) -> bool:
    """Does the category go two clearly different ways from one place?

    Its displacements lie in two clusters, as in `two_clusters`, whose starts do not.
    """
    members = run.primitives.of(category)
    if len(members) < 2 * LEAST_MEMBERS:
        return False
    q = run.primitives.start[members] / span
    x = run.primitives.displacement[members] / span
    second = _two_means(x)
    if min(second.sum(), (~second).sum()) < LEAST_MEMBERS:
        return False
    return _separation(x, second) >= SEPARATION and _separation(q, second) < ONE_PLACE


def told_apart(
    run: Run, clusters: TwoClusters, predictor: PredictorName, span: FloatArray
) -> float:
    """Share of estimates nearer to what their own cluster did than to what the other did [-].

    Counted after initialising, in each cluster by itself; then the mean of the two, so that a
    model which always says the same gets one half however unequal the clusters are. nan where
    a cluster has no estimate.
    """
    known = run.initialised[clusters.members]
    said = run.estimate[predictor][clusters.members][known] / span
    second = clusters.second[known]
    if second.all() or not second.any():
        return np.nan
    means = clusters.displacements / span
    to_first, to_second = (np.linalg.norm(said - mean, axis=1) for mean in means)
    return float(
        0.5 * np.mean(to_first[~second] < to_second[~second])
        + 0.5 * np.mean(to_second[second] < to_first[second])
    )


def _two_means(points: FloatArray) -> npt.NDArray[np.bool_]:
    """Lloyd's two means (N,), begun from the halves along the longest axis: no chance in it."""
    centred = points - points.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    second: npt.NDArray[np.bool_] = centred @ axis > 0.0
    for _ in range(_ROUNDS):
        if second.all() or not second.any():
            break
        first_centre, second_centre = _centres(points, second)
        to_second = np.linalg.norm(points - second_centre, axis=1)
        nearer = to_second < np.linalg.norm(points - first_centre, axis=1)
        if np.array_equal(nearer, second):
            break
        second = nearer
    return second


def _centres(points: FloatArray, second: npt.NDArray[np.bool_]) -> FloatArray:
    return np.array([points[~second].mean(axis=0), points[second].mean(axis=0)])


def _separation(points: FloatArray, second: npt.NDArray[np.bool_]) -> float:
    centres = _centres(points, second)
    within = points - centres[second.astype(int)]
    rms = float(np.sqrt(np.mean(np.sum(within**2, axis=1))))
    apart = float(np.linalg.norm(centres[1] - centres[0]))
    return apart / rms if rms > 0.0 else (np.inf if apart > 0.0 else 0.0)
