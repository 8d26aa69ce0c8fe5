"""Noise at a threshold, at 100 Hz for 20 s, nightly for a minute: people are told once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from rampe_guard.core.alarm import Level, State
from rampe_guard.core.annunciator import Annunciator, Moment
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import AlertEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.levels import LevelRules
from rampe_guard.core.risk import ZoneRisk
from rampe_guard.core.types import (
    ActuatorSample,
    Certificate,
    FloatArray,
    Inputs,
    JoystickSample,
    Placement,
    SweepResult,
    ZoneSweep,
)
from tests.support.core_rig import CONFIG, LIMITS
from tests.support.depth import depth

STEPS, DT = depth(2000, 6000), 0.01
STOP_S = 0.8


class Jittery:
    """The arm stands at the edge of a margin, and its distance is measured to 2 cm."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        """Inside about half of the time, and closing in."""
        del start, displacement, any_path, clearance, wider_m, placed
        if only is not None and "wall" not in only:
            return SweepResult(())
        now = float(self._rng.normal(0.0, 0.02))
        kind = Certificate.CONTACT if now <= 0.0 else Certificate.FREE
        fraction = 0.0 if now <= 0.0 else None
        near = max(now, 0.0)
        return SweepResult((ZoneSweep("wall", kind, fraction, "arm", None, near, now, True, 0.1),))  # noqa: FBT003


def test_two_centimetres_at_a_margin_annunciate_once() -> None:
    guard = Guard(CONFIG, LIMITS, Jittery(5), start_s=0.0)
    told: list[AlertEvent] = []
    for k in range(1, STEPS + 1):
        now = k * DT
        stick = JoystickSample(now, np.array([0.5]), now)
        arm = ActuatorSample(now, np.array([0.0]), None, now)
        events = guard.step(Inputs((stick,), (arm,)), now)
        told += [e for e in events if isinstance(e, AlertEvent)]
    assert [(e.level, e.state) for e in told if e.kind == "transition"] == [
        (Level.IMMINENT, State.UNACKED)
    ]
    assert {e.alert_id for e in told} == {"offline.wall.1"}
    assert [e.seq for e in told] == list(range(1, len(told) + 1))


def at_time(limit_s: float) -> Callable[[np.random.Generator], tuple[float, float]]:
    """A likely contact whose time jitters about a limit: its odds and its time."""
    return lambda rng: (0.9, limit_s + rng.normal(0.0, 0.1))


def at_chance(level: float) -> Callable[[np.random.Generator], tuple[float, float]]:
    """A contact in 2 s whose odds jitter about a threshold."""
    return lambda rng: (float(np.clip(level + rng.normal(0.0, 0.02), 0.0, 1.0)), 2.0)


RULES = AlertConfig(warning_probability=0.5, caution_probability=0.25)


@pytest.mark.parametrize(
    ("jitter", "levels"),
    [
        (at_time(STOP_S), {Level.WARNING, Level.IMMINENT}),
        (at_time(RULES.horizon_s), {Level.CAUTION, Level.WARNING}),
        (at_chance(RULES.warning_probability), {Level.CAUTION, Level.WARNING}),
        (at_chance(0.27), {Level.CAUTION}),
    ],
    ids=["time to stop", "horizon", "warning odds", "caution odds"],
)
def test_a_jittering_forecast_settles_on_its_worst_within_a_second(
    jitter: Callable[[np.random.Generator], tuple[float, float]], levels: set[Level]
) -> None:
    rng = np.random.default_rng(3)
    config = replace(RULES, realarm_s=120.0)  # so that only noise could tell
    rules, annunciator = LevelRules(config), Annunciator(config, "boot")
    told: list[AlertEvent] = []
    seen: set[Level] = set()
    for k in range(STEPS // 4):
        odds, time_s = jitter(rng)
        risk = ZoneRisk("wall", (odds,) * 3, odds, odds, odds, time_s, "intent", floor=False)
        sweep = ZoneSweep("wall", Certificate.CONTACT, 0.5, "arm", None, 0.0, 0.5, True)  # noqa: FBT003
        found = rules.foreseen(sweep, risk, annunciator.shown("wall"), STOP_S)
        seen.add(found.level)
        moment = Moment(k * DT, k * DT, None, None, None)
        told += annunciator.update({"wall": found}, moment)
    transitions = [e for e in told if e.kind == "transition"]
    assert levels <= seen, "the noise is worth its name"
    assert {e.level for e in transitions} <= levels
    assert max(e.level for e in transitions) is max(levels)
    assert len(transitions) <= len(levels)
    assert transitions[-1].now_s < 1.0
