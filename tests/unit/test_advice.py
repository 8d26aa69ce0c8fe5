"""Advice on the machine of one joint before a wall in closed form: its margin begins at 1.0."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.advice import Adviser, Instant
from rampe_guard.core.config import ActuatorConfig, AdviceConfig
from rampe_guard.core.events import AdviceEvent
from rampe_guard.core.types import Certificate, FloatArray, SweepResult
from rampe_guard.simulate.machine import at_rest, build_machine, step
from tests.support.core_rig import ACTUATORS, CONFIG, DT, LIMITS, CoreRig, Wall
from tests.support.depth import depth

EDGE = 1.0
ON = AdviceConfig(enabled=True)
ADVISED = replace(CONFIG, advice=ON)


def moment(q: float, v: float = 0.0, command: float = 0.0, now_s: float = 0.0) -> Instant:
    position, velocity, levers = np.array([q]), np.array([v]), np.array([command])
    return Instant(position, velocity, levers, {}, lambda _: False, now_s)


def adviser(wall: Wall | None = None) -> Adviser:
    return Adviser(ACTUATORS, LIMITS, ON, wall or Wall())


def test_far_away_all_is_free() -> None:
    advice = adviser().advise(moment(-1.0))
    assert advice.shares.tolist() == [[1.0, 1.0]]
    assert advice.zones == ((None, None),)


def test_near_the_wall_only_the_way_to_it_is_limited() -> None:
    advice = adviser().advise(moment(0.9))
    low, high = advice.shares[0]
    assert low == 1.0
    # w²/(2·2) + w·0.25 = 0.098, of a top speed of 1
    assert high == pytest.approx((-0.25 + np.sqrt(0.25**2 + 0.098)) * 2.0, rel=1e-9)
    assert advice.zones == ((None, "wall"),)


def test_in_the_margin_only_the_way_out_is_left() -> None:
    assert adviser().advise(moment(1.05)).shares.tolist() == [[1.0, 0.0]]


def test_what_is_met_whatever_is_done_is_not_approached() -> None:
    advice = adviser().advise(moment(0.95, v=1.0, command=1.0))
    assert advice.shares.tolist() == [[1.0, 0.0]]


def test_what_cannot_be_computed_is_not_free() -> None:
    advice = adviser(Wall(answer=Certificate.UNKNOWN)).advise(moment(0.0, v=0.1))
    assert advice.shares[0, 1] == 0.0
    assert advice.zones[0][1] == "wall"


def test_shares_fall_at_once_and_rise_slowly() -> None:
    held = adviser()
    assert held.advise(moment(0.99, now_s=0.0)).shares[0, 1] < 0.1
    rising = held.advise(moment(0.0, command=1.0, now_s=0.1))
    assert rising.shares[0, 1] == pytest.approx(held_share(0.99) + 0.1 * ON.rise_per_s)
    assert rising.zones[0][1] == "wall"
    assert held.advise(moment(0.0, command=1.0, now_s=1.0)).shares[0, 1] == 1.0
    assert held.advise(moment(0.99, now_s=1.001, command=1.0)).shares[0, 1] < 0.1


def held_share(q: float) -> float:
    return float(adviser().advise(moment(q)).shares[0, 1])


@pytest.mark.no_cover  # thousands of steps
@settings(deadline=None, max_examples=depth(60, 1000))
@given(
    st.floats(0.2, 2.0),
    st.floats(0.5, 4.0),
    st.floats(0.02, 0.4),
    st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=4),
    st.floats(-0.5, 0.9),
)
def test_who_follows_it_never_enters_the_margin(
    top: float, braking: float, lag_s: float, levers: list[float], start: float
) -> None:
    one = (ActuatorConfig("swing", 0, 1, top, braking, lag_s, 0.05, "rad"),)
    wise = Adviser(one, LIMITS, ON, Wall())
    machine = build_machine(one, LIMITS, time_constant_s=0.02)
    state, most = at_rest(machine, np.array([start])), np.zeros((1, 2))
    for k in range(int(0.5 * len(levers) / DT)):
        lever = np.array([levers[int(2.0 * k * DT)]])
        if k % 3 == 0:  # every 0.06 s
            now = Instant(state.position, state.velocity, lever, {}, lambda _: False, k * DT)
            most = wise.advise(now).shares
        state = step(machine, state, np.clip(lever, -most[:, 0], most[:, 1]), DT)
        assert state.position[0] <= EDGE + 1e-3 * top


@dataclass
class Corner:
    """Two actuators; solid where both are large: neither alone gets there from the start."""

    asked: list[FloatArray] = field(default_factory=list)

    def sweep(self, start: FloatArray, displacement: FloatArray, **_: object) -> SweepResult:
        """The sum of both is at most 1."""
        self.asked.append(displacement)
        wall = Wall(at=1.1, name="corner")
        return wall.sweep(np.array([start.sum()]), np.array([displacement.sum()]))


def test_levers_that_are_out_together_are_judged_together() -> None:
    two = (*ACTUATORS, replace(ACTUATORS[0], name="boom", axis=1))
    limits = np.array([[-2.0, 2.0]] * 2)
    still = np.zeros(2)

    def advised(command: list[float]) -> FloatArray:
        wise = Adviser(two, limits, ON, Corner())
        q = np.array([0.2, 0.2])
        return wise.advise(
            Instant(q, still, np.array(command), {}, lambda _: False, 0.0)
        ).shares  # fmt: skip

    assert advised([1.0, 0.0])[:, 1].tolist() == [1.0, 1.0]
    both = advised([1.0, 1.0])
    assert (both[:, 1] < 1.0).all()
    assert both[:, 0].tolist() == [1.0, 1.0]
    # the sum of both ways is within the room, of 0.6
    reach = both[:, 1] * ON.hold_s + both[:, 1] ** 2 / 4.0
    assert reach.sum() <= 0.6


def given_by(rig: CoreRig) -> list[AdviceEvent]:
    return [e for e in rig.events if isinstance(e, AdviceEvent)]


def test_a_guard_advises_at_its_pace() -> None:
    rig = CoreRig(config=ADVISED)
    rig.hold(0.2, 2.0)
    found = given_by(rig)
    times = [e.now_s for e in found if e.advice is not None]
    assert np.diff(times).min() >= ON.period_s - 1e-6
    assert np.diff(times).max() <= ON.period_s + DT
    assert [e.seq for e in found] == list(range(1, len(found) + 1))


def test_a_guard_that_was_not_asked_says_nothing() -> None:
    rig = CoreRig()
    rig.hold(0.2, 1.0)
    assert not given_by(rig)


def test_blind_there_is_no_advice_and_that_is_told_at_once() -> None:
    rig = CoreRig(config=ADVISED)
    rig.hold(0.2, 1.0)
    rig.events.clear()
    rig.hold(0.2, 2.0, arm=False)
    found = given_by(rig)
    assert all(e.advice is None and e.why for e in found)
    assert found[0].now_s <= 1.0 + CONFIG.inputs.actuators_timeout_s + 2 * DT
    assert np.diff([e.now_s for e in found]).max() <= 0.2 + DT
    rig.hold(0.0, 0.1)
    assert given_by(rig)[-1].advice is not None


def test_another_scene_is_advised_at_once() -> None:
    rig = CoreRig(Wall(at=1.9), ADVISED)
    rig.hold(0.5, 1.6)
    assert given_by(rig)[-1].advice is not None
    rig.guard.change_scene(Wall(at=0.95), ["wall"])
    rig.hold(0.0, 0.1)
    last = given_by(rig)[-1].advice
    assert last is not None
    assert last.shares[0, 1] < 0.3
