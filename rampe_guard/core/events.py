"""What a step of the guard has to say. The wire gives these values their JSON form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from rampe_guard.core.advice import Advice
from rampe_guard.core.alarm import Inhibit, Level, State
from rampe_guard.core.foresight import NOTHING, Outlook
from rampe_guard.core.types import Category, FloatArray, ZoneSweep

Source: TypeAlias = Literal["stopping", "intent", "next", "contact", "system"]
Quality: TypeAlias = Literal["good", "degraded", "stale"]

SYSTEM_ZONE = "system"
"""Zone name of the alert that says: not monitoring."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What one evaluation says of one zone.

    Attributes:
        level: how urgent.
        source: the forecast that found it.
        probability: of contact [-].
        time_to_collision_s: [s], None where no time follows.
        sweep: the sweep result behind it; None for system evidence.
        note: extra words (system: the reason).
        similar: similar situations of the past that were asked (see `foresight`), 0 for none.
        met: those of them that went on to meet the zone.
        onward: position to which the likeliest of these leads (n,) [unit], or None.
    """

    level: Level
    source: Source
    probability: float | None
    time_to_collision_s: float | None
    sweep: ZoneSweep | None
    note: str = ""
    similar: int = 0
    met: int = 0
    onward: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class PredictionSummary:
    """The forecast of the primitive under way, as alerts and predictions carry it.

    Attributes:
        category: Ω.
        occurrences: primitives of this category learned.
        mean: expected displacement (n,) [unit]; None while nothing is known.
        scale: Student-t scale (n,) [unit].
        dof: Student-t degrees of freedom (n,).
        start: q[k] (n,) [unit].
        endpoint: where it likely ends (n,) [unit].
        progress: displacement so far, or in the end (n,) [unit].
        related: categories that the forecast borrows from.
        endpoints: both ends where two futures were seen (2, n) [unit], likelier first.
        endpoint_shares: their shares (2,) [-].
    """

    category: Category
    occurrences: int
    mean: FloatArray | None
    scale: FloatArray | None
    dof: FloatArray | None
    start: FloatArray
    endpoint: FloatArray | None
    progress: FloatArray
    related: tuple[Category, ...] = ()
    endpoints: FloatArray | None = None
    endpoint_shares: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class AlertEvent:
    """An alert to publish: a transition, or a repeat of one that is active.

    ``link`` is that of the last cause: an alert that clears tells of the link that it was about,
    while ``evidence`` is of now. Times are on the clock of ``now_s`` [s], but for ``stamp_s``.
    """

    kind: Literal["transition", "repeat"]
    alert_id: str
    seq: int
    zone: str
    level: Level
    previous_level: Level
    state: State
    quality: Quality
    evidence: Evidence
    link: str | None
    prediction: PredictionSummary | None
    stamp_s: float | None
    now_s: float
    input_age_s: float | None
    raised_s: float
    changed_s: float
    acked_by: str | None
    inhibit: Inhibit = Inhibit.NONE
    shelved_by: str | None = None
    shelved_until_s: float | None = None


@dataclass(frozen=True, slots=True)
class SweepSummary:
    """One zone of one forecast, for the prediction message."""

    source: Source
    zone: ZoneSweep
    probability: float
    time_to_collision_s: float | None


@dataclass(frozen=True, slots=True)
class PredictionEvent:
    """A primitive started or ended, or its forecast changed.

    When it ended, ``prediction.progress`` is its displacement x, and ``learned`` says
    whether the model took it; if not, ``refusal`` is a word for why.
    """

    event: Literal["started", "updated", "ended"]
    seq: int
    prediction: PredictionSummary
    learned: bool
    refusal: str | None
    sweeps: tuple[SweepSummary, ...]
    stamp_s: float
    now_s: float
    outlook: Outlook = NOTHING


@dataclass(frozen=True, slots=True)
class RefusalEvent:
    """A sample that was refused: which input or object, a word for it, and its values."""

    input: str
    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class AdviceEvent:
    """Speed advice to publish; ``advice`` is None while nobody can give any, with ``why``."""

    seq: int
    advice: Advice | None
    why: str | None
    degraded: bool
    stamp_s: float | None
    now_s: float


Event: TypeAlias = AlertEvent | PredictionEvent | AdviceEvent | RefusalEvent
