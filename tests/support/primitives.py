"""Made-up primitives for tests of what predicts them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import Category
from rampe_guard.evaluate.segments import Segment, Start


def primitive(
    category: Category,
    q: npt.ArrayLike,
    x: npt.ArrayLike,
    *,
    velocity: npt.ArrayLike | None = None,
    duration_s: float = 1.0,
    path: Sequence[Sequence[float]] = (),
    times_s: Sequence[float] | None = None,
) -> Segment:
    """A complete primitive of Ω ``category`` from ``q`` over ``x``, begun at 0 s.

    The lever is held hard over and the arm at rest at every position of ``path``.
    """
    start = np.asarray(q, dtype=np.float64)
    way = np.array(path, dtype=np.float64).reshape(-1, len(start))
    return Segment(
        start=Start(
            category=category,
            q=start,
            velocity=np.zeros_like(start) if velocity is None else np.asarray(velocity),
            command=np.array(category, dtype=np.float64),
            xi=np.zeros(0),
            time_s=0.1,
        ),
        start_s=0.0,
        end_s=duration_s,
        displacement=np.asarray(x, dtype=np.float64),
        times_s=np.array([0.1 * k for k in range(len(path))] if times_s is None else times_s),
        path=way,
        velocities=np.zeros_like(way),
        commands=np.tile(np.array(category, dtype=np.float64), (len(way), 1)),
        complete=True,
    )
