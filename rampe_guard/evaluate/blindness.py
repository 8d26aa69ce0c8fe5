"""When a guard did not monitor, and what that does to contacts and alarms.

Spans (b, 2) [s] are in order and apart; the end is inf while it goes on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rampe_guard.core.types import FloatArray

NEVER: FloatArray = np.zeros((0, 2))
"""Of a guard that monitored all the time."""
NEVER.setflags(write=False)


class Blindness:
    """Keeps the spans in which a guard said that it does not monitor; tell it in order of time."""

    def __init__(self) -> None:
        self._over: list[tuple[float, float]] = []
        self._since_s: float | None = None

    def take(self, time_s: float, *, monitoring: bool) -> None:
        """What the guard said at ``time_s`` [s]; it holds until it says otherwise."""
        if not monitoring and self._since_s is None:
            self._since_s = time_s
        elif monitoring and self._since_s is not None:
            if time_s > self._since_s:
                self._over.append((self._since_s, time_s))
            self._since_s = None

    @property
    def spans(self) -> FloatArray:
        """All of them (b, 2) [s]."""
        now = [] if self._since_s is None else [(self._since_s, np.inf)]
        return np.array([*self._over, *now], dtype=np.float64).reshape(-1, 2)


def blind_s(blind: FloatArray, window: tuple[float, float]) -> float:
    """How much of a window was blind [s]."""
    within = np.clip(blind, *window)
    return float((within[:, 1] - within[:, 0]).sum())


def hidden(entered_s: FloatArray, blind: FloatArray) -> npt.NDArray[np.bool_]:
    """Which contacts (c,) came while nobody watched: after a span began, at its end at the latest.

    At its end the guard knows of the contact and of its own sight at once: too late to warn.
    """
    if not len(blind):
        return np.zeros(len(entered_s), dtype=np.bool_)
    last = np.searchsorted(blind[:, 0], entered_s, side="left") - 1
    found: npt.NDArray[np.bool_] = (last >= 0) & (entered_s <= blind[last, 1])
    return found


def seen(alarms: FloatArray, blind: FloatArray) -> FloatArray:
    """What is left of alarms (a, 2) without the time in which they were frozen."""
    if not len(blind):
        return alarms
    kept: list[tuple[float, float]] = []
    first = np.searchsorted(blind[:, 1], alarms[:, 0], side="right").tolist()
    after = np.searchsorted(blind[:, 0], alarms[:, 1], side="right").tolist()
    for (start_s, end_s), low, high in zip(alarms.tolist(), first, after, strict=True):
        at_s = start_s
        for begin_s, over_s in blind[low:high].tolist():
            if begin_s > at_s:
                kept.append((at_s, begin_s))
            at_s = over_s
        if at_s < end_s or at_s == start_s:
            kept.append((at_s, end_s))
    return np.array(kept, dtype=np.float64).reshape(-1, 2)


def since(entered_s: FloatArray, blind: FloatArray) -> FloatArray:
    """From when on the guard watched without a break until each contact (c,) [s], or -inf."""
    before = np.concatenate(([-np.inf], blind[:, 1]))
    found: FloatArray = before[np.searchsorted(blind[:, 1], entered_s, side="right")]
    return found


def together(spans: FloatArray, blind: FloatArray) -> FloatArray:
    """Both kinds of spans as one, where they meet joined."""
    if not len(blind):
        return spans
    joined: list[list[float]] = []
    for start_s, end_s in sorted([*spans.tolist(), *blind.tolist()]):
        if joined and start_s <= joined[-1][1]:
            joined[-1][1] = max(joined[-1][1], end_s)
        else:
            joined.append([start_s, end_s])
    return np.array(joined)
