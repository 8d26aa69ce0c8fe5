"""The work as a cycle of waypoints, and the drawing of one cycle with all its human chance.

`plan_cycle` settles everything random about a cycle except the tremble of the hand: where
each move aims, how hard it is pushed, when each lever starts, and whether it goes too far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Move:
    """One actuator driven to ``target`` [unit], its lever first touched after ``start_s`` [s].

    ``spread`` is the standard deviation of the aim from cycle to cycle [unit].
    """

    actuator: str
    target: float
    spread: float = 0.0
    start_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Overshoot:
    """How ``actuator`` goes too far: by ``least`` to ``most`` [unit], signed, past its target."""

    actuator: str
    least: float
    most: float


@dataclass(frozen=True, slots=True)
class Waypoint:
    """One phase of the work: the moves made together, what can go wrong, a rest after it [s]."""

    name: str
    moves: tuple[Move, ...]
    overshoot: Overshoot | None = None
    pause_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Habits:
    """How the operator handles levers; pairs are (least, most) of a uniform draw.

    Attributes:
        vigour: lever at full push [-].
        gentle: least lever that he uses while moving [-].
        slow_down_s: he eases off within what full speed covers in this time [s].
        foresight: how much of the coming stop he allows for; 1 is exact [-].
        stagger_s: extra delay of each lever [s].
        reaction_s: pause between phases [s].
        notice_s: how long he takes to see that he went too far [s].
        lever_rate: fastest lever motion [1/s].
        lever_noise: standard deviation of the lever about what he means [share of it].
        overshoot_probability: per cycle [-].
    """

    vigour: tuple[float, float] = (0.85, 1.0)
    gentle: float = 0.4
    slow_down_s: float = 0.25
    foresight: tuple[float, float] = (0.8, 1.2)
    stagger_s: tuple[float, float] = (0.0, 0.15)
    reaction_s: tuple[float, float] = (0.05, 0.2)
    notice_s: tuple[float, float] = (0.25, 0.5)
    lever_rate: float = 8.0
    lever_noise: float = 0.03
    overshoot_probability: float = 0.15


@dataclass(frozen=True, slots=True)
class PlannedMove:
    """A move of one cycle, all chance drawn: actuator index, target [unit], start [s], push."""

    actuator: int
    target: float
    start_s: float
    push: float
    foresight: float


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of one cycle; ``too_far`` marks the phase that overshoots."""

    name: str
    moves: tuple[PlannedMove, ...]
    pause_s: float
    too_far: bool = False


def plan_cycle(
    waypoints: Sequence[Waypoint],
    names: Sequence[str],
    habits: Habits,
    rng: np.random.Generator,
) -> tuple[Phase, ...]:
    """Draw one cycle: where, how hard, and whether it goes too far somewhere.

    Args:
        waypoints: the work, in order.
        names: actuator names in actuator order.
        habits: the operator's.
        rng: advanced by the draw.

    Returns:
        The phases in order; a phase that goes too far is followed by one that comes back.
    """
    risky = [i for i, w in enumerate(waypoints) if w.overshoot is not None]
    slip = bool(rng.random() < habits.overshoot_probability) and bool(risky)
    slips_at = int(rng.choice(risky)) if slip else -1
    phases: list[Phase] = []
    for i, waypoint in enumerate(waypoints):
        phase = _draw_phase(waypoint, names, habits, rng)
        over = waypoint.overshoot
        if i == slips_at and over is not None:
            phases.extend(_too_far(phase, names.index(over.actuator), over, habits, rng))
        else:
            phases.append(phase)
    return tuple(phases)


def _draw_phase(
    waypoint: Waypoint, names: Sequence[str], habits: Habits, rng: np.random.Generator
) -> Phase:
    moves = tuple(
        PlannedMove(
            actuator=names.index(move.actuator),
            target=float(move.target + np.clip(rng.normal(), -2.0, 2.0) * move.spread),
            start_s=float(move.start_s + rng.uniform(*habits.stagger_s)),
            push=float(rng.uniform(*habits.vigour)),
            foresight=float(rng.uniform(*habits.foresight)),
        )
        for move in waypoint.moves
    )
    return Phase(waypoint.name, moves, float(waypoint.pause_s + rng.uniform(*habits.reaction_s)))


def _too_far(
    phase: Phase, actuator: int, over: Overshoot, habits: Habits, rng: np.random.Generator
) -> tuple[Phase, Phase]:
    """Split a phase in two: beyond the target on one actuator, then back to where it was meant."""
    by = float(rng.uniform(over.least, over.most))
    meant = next(m for m in phase.moves if m.actuator == actuator)
    beyond = PlannedMove(actuator, meant.target + by, meant.start_s, meant.push, meant.foresight)
    others = tuple(m for m in phase.moves if m is not meant)
    back = PlannedMove(actuator, meant.target, 0.0, meant.push, 1.0)
    late = float(rng.uniform(*habits.notice_s))
    return (
        Phase(phase.name, (beyond, *others), late, too_far=True),
        Phase("come back", (back,), phase.pause_s),
    )


def check_waypoints(waypoints: Sequence[Waypoint], names: Sequence[str]) -> None:
    """Refuse work that the machine cannot do.

    Raises:
        ValueError: no waypoint; one that moves nothing, or an unknown actuator; an overshoot
            of an actuator that its waypoint does not move.
    """
    if not waypoints:
        raise ValueError("an operator needs at least one waypoint")
    for waypoint in waypoints:
        moved = {m.actuator for m in waypoint.moves}
        if not moved or not moved <= set(names):
            raise ValueError(
                f"waypoint {waypoint.name!r} moves {sorted(moved)}; the machine has {list(names)}"
            )
        over = waypoint.overshoot
        if over is not None and over.actuator not in moved:
            raise ValueError(
                f"waypoint {waypoint.name!r} overshoots {over.actuator!r}, which it does not move"
            )
