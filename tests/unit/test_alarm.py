import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rampe_guard.core.alarm import Alarm, Inhibit, Level, State
from rampe_guard.core.config import AlertConfig
from rampe_guard.errors import RefusedError

CONFIG = AlertConfig()
C, W, I, O = Level.CAUTION, Level.WARNING, Level.IMMINENT, Level.CLEAR  # noqa: E741


def run(alarm: Alarm, evidence: list[Level], start: float = 0.0, dt: float = 0.1) -> list[Level]:
    shown = []
    for k, level in enumerate(evidence):
        alarm.step(level, start + k * dt)
        shown.append(alarm.level)
    return shown


def test_imminent_is_told_at_once_and_a_warning_at_the_second_time() -> None:
    assert run(Alarm(CONFIG), [I]) == [I]
    assert run(Alarm(CONFIG), [W, W]) == [O, W]


def test_pending_is_not_shown() -> None:
    alarm = Alarm(CONFIG)
    assert not alarm.step(W, 0.0)
    assert (alarm.state, alarm.active) == (State.PENDING, False)
    alarm.step(O, 0.1)
    assert alarm.state is State.NORMAL


def test_one_blip_of_a_warning_is_never_shown() -> None:
    assert run(Alarm(CONFIG), [W, O] * 20) == [O] * 40


def test_calm_comes_slowly() -> None:
    alarm = Alarm(CONFIG)
    shown = run(alarm, [W] * 20 + [O] * 10)
    gone = shown.index(O, 2) - 20
    assert gone * 0.1 == pytest.approx(CONFIG.off_delay_s - 0.1)


def test_an_alert_lives_at_least_its_minimum() -> None:
    alarm = Alarm(CONFIG)
    shown = run(alarm, [I] + [O] * 20)
    assert shown[:10] == [I] * 10
    assert shown[10] is O


def test_a_rise_asks_for_attention_again() -> None:
    alarm = Alarm(CONFIG)
    run(alarm, [W, W])
    assert alarm.acknowledge("ann")
    assert (alarm.state, alarm.acked_by) == (State.ACKED, "ann")
    assert alarm.step(I, 0.3)
    assert (alarm.state, alarm.acked_by) == (State.UNACKED, None)
    assert alarm.previous is W
    assert alarm.number == 1


def test_it_falls_to_the_level_that_is_still_caused() -> None:
    alarm = Alarm(CONFIG)
    shown = run(alarm, [I] * 3 + [C] * 30)
    assert shown[-1] is C
    assert O not in shown


def test_a_latched_alarm_waits_for_someone() -> None:
    alarm = Alarm(CONFIG, latched=True)
    run(alarm, [I] + [O] * 20)
    assert (alarm.level, alarm.state, alarm.active) == (O, State.RTN_UNACKED, True)
    assert alarm.acknowledge("bob")
    assert alarm.state is State.NORMAL


def test_a_latched_alarm_can_rise_again() -> None:
    alarm = Alarm(CONFIG, latched=True)
    run(alarm, [I] + [O] * 20 + [I])
    assert (alarm.level, alarm.state) == (I, State.UNACKED)


def test_nothing_to_acknowledge() -> None:
    assert not Alarm(CONFIG).acknowledge("ann")


def test_few_evaluations_take_longer_to_calm_than_the_off_delay() -> None:
    alarm = Alarm(CONFIG)
    shown = run(alarm, [W] * 4 + [O] * 10, dt=0.5)
    assert shown.index(O, 2) - 4 == CONFIG.release_steps - 1


def test_a_gap_without_data_calms_nothing() -> None:
    alarm = Alarm(CONFIG)
    run(alarm, [W] * 4)
    assert not alarm.step(O, 100.0)
    assert alarm.level is W


@pytest.mark.parametrize("acked", [True, False])
def test_what_goes_on_asks_again(acked: bool) -> None:
    alarm = Alarm(CONFIG)
    run(alarm, [W, W])
    if acked:
        assert alarm.acknowledge("ann")
    late = int(CONFIG.realarm_s / 0.1) + 2
    changes = [k for k in range(2, 2 * late) if alarm.step(W, k * 0.1)]
    assert changes == pytest.approx(
        [1 + CONFIG.realarm_s / 0.1, 1 + 2 * CONFIG.realarm_s / 0.1], abs=1
    )
    assert (alarm.state, alarm.acked_by, alarm.number) == (State.UNACKED, None, 1)


def test_a_warning_is_shelved_for_as_long_as_the_cap_allows() -> None:
    alarm = Alarm(CONFIG)
    run(alarm, [W, W])
    with pytest.raises(RefusedError, match="31 s is not above 0 and at most 30 s"):
        alarm.shelve("ann", 31.0, 1.0)
    alarm.shelve("ann", 30.0, 1.0)
    assert (alarm.level, alarm.state, alarm.inhibit) == (W, State.UNACKED, Inhibit.SHELVED)
    with pytest.raises(RefusedError, match=r"ann has shelved it for 10\.0 s more"):
        alarm.shelve("ann", 30.0, 21.0)
    assert not alarm.lapse(30.9)
    assert alarm.lapse(31.0)
    assert (alarm.state, alarm.inhibit, alarm.shelved_by) == (State.UNACKED, Inhibit.NONE, None)


def test_what_is_imminent_breaks_through_and_stays_off_the_shelf() -> None:
    alarm = Alarm(CONFIG)
    run(alarm, [W, W])
    alarm.shelve("ann", 30.0, 0.2)
    assert alarm.step(I, 0.3)
    assert (alarm.state, alarm.inhibit, alarm.shelved_until_s) == (
        State.UNACKED,
        Inhibit.NONE,
        None,
    )
    with pytest.raises(RefusedError, match="imminent"):
        alarm.shelve("ann", 1.0, 0.4)
    run(alarm, [W] * 40, start=0.4)
    assert (alarm.level, alarm.inhibit) == (W, Inhibit.NONE)


def test_what_is_gone_is_acknowledged_not_shelved() -> None:
    alarm = Alarm(CONFIG, latched=True)
    run(alarm, [I] + [O] * 20)
    with pytest.raises(RefusedError, match="acknowledge"):
        alarm.shelve("ann", 5.0, 5.0)


@given(
    st.lists(st.tuples(st.sampled_from(Level), st.floats(0.005, 0.4)), max_size=200),
    st.booleans(),
)
def test_whatever_comes_the_alarm_keeps_its_promises(
    steps: list[tuple[Level, float]], latched: bool
) -> None:
    alarm, now = Alarm(CONFIG, latched=latched), 0.0
    changed = -10.0
    for evidence, dt in steps:
        now += dt
        before = alarm.level
        assert alarm.step(evidence, now) or alarm.level is before
        assert alarm.level >= evidence or evidence < Level.IMMINENT
        if alarm.level < before:
            assert now - changed >= CONFIG.min_on_s
        if alarm.level is not before:
            changed = now
        assert (alarm.level > Level.CLEAR) == (alarm.state in {State.UNACKED, State.ACKED})


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5, deadline=None)
def test_noise_at_a_threshold_for_a_minute_annunciates_once(seed: int) -> None:
    """100 Hz; the cause comes and goes at random, but never stays away for the off-delay."""
    rng = random.Random(seed)
    alarm = Alarm(CONFIG)
    for k in range(6000):
        alarm.step(W if k < 2 or k % 40 == 0 or rng.random() < 0.3 else O, k * 0.01)
    assert alarm.number == 1
    assert alarm.level is W
