"""From a recorded run to its motion primitives, by the product's own detector and tracker."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rampe_guard.core.config import ActuatorConfig, JoystickConfig
from rampe_guard.core.joystick import CategoryChange, CategoryDetector
from rampe_guard.core.primitive import FinishedPrimitive, PrimitiveTracker
from rampe_guard.core.types import Category, FloatArray


@dataclass(frozen=True, slots=True)
class Primitives:
    """The K primitives of one run of n actuators, in order.

    Attributes:
        category: Ω of each (K).
        occurrence: k, the how-manieth of its category (K,), from 1.
        start_s: when it began (K,) [s].
        end_s: when it ended (K,) [s].
        start: q[k] (K, n) [unit].
        displacement: x[k] (K, n) [unit].
    """

    category: tuple[Category, ...]
    occurrence: npt.NDArray[np.int64]
    start_s: FloatArray
    end_s: FloatArray
    start: FloatArray
    displacement: FloatArray

    def of(self, category: Category) -> npt.NDArray[np.int64]:
        """Indices of the primitives of ``category``, in order."""
        return np.array([i for i, c in enumerate(self.category) if c == category], dtype=np.int64)

    def most_frequent(self, count: int) -> tuple[Category, ...]:
        """The ``count`` categories seen most often, at a tie the one seen first."""
        return tuple(c for c, _ in Counter(self.category).most_common(count))


def primitives_of(
    time_s: FloatArray,
    axes: FloatArray,
    position: FloatArray,
    actuators: Sequence[ActuatorConfig],
    joystick: JoystickConfig | None = None,
) -> Primitives:
    """Cut a run into primitives, sample by sample, as the guard would have done live.

    A primitive shorter than the debounce is dropped, as the guard does. One that is still
    under way at the end has no displacement and is dropped too.

    Args:
        time_s: (T,) [s], increasing.
        axes: joystick (T, m).
        position: measured (T, n) [unit].
        actuators: which axis moves which.
        joystick: how the levers are read.
    """
    config = joystick or JoystickConfig()
    detector = CategoryDetector(tuple(actuators), config)
    tracker = PrimitiveTracker()
    finished: list[FinishedPrimitive] = []

    def take(change: CategoryChange | None) -> None:
        ended = None if change is None else tracker.change(change)
        if ended is not None and ended.end_s - ended.primitive.start_s >= config.debounce_s:
            finished.append(ended)

    for stamp_s, lever, q in zip(time_s.tolist(), axes, position, strict=True):
        take(detector.update(stamp_s, lever))  # the command causes the motion: lever first
        tracker.position(stamp_s, q)
        take(detector.advance(stamp_s))
    return _stack(finished, len(actuators))


def _stack(finished: Sequence[FinishedPrimitive], n: int) -> Primitives:
    seen: Counter[Category] = Counter()
    occurrence = []
    for f in finished:
        seen[f.primitive.category] += 1
        occurrence.append(seen[f.primitive.category])
    return Primitives(
        category=tuple(f.primitive.category for f in finished),
        occurrence=np.array(occurrence, dtype=np.int64),
        start_s=np.array([f.primitive.start_s for f in finished]),
        end_s=np.array([f.end_s for f in finished]),
        start=np.array([f.primitive.start for f in finished]).reshape(-1, n),
        displacement=np.array([f.displacement for f in finished]).reshape(-1, n),
    )
