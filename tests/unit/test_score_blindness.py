"""Scores where the guard did not monitor all the time, and where the arm began inside."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.alarm import Level
from rampe_guard.evaluate.blindness import Blindness, blind_s
from rampe_guard.evaluate.episodes import AlertSpan, Contact, inside_at_first_s
from rampe_guard.evaluate.foretold import came
from rampe_guard.evaluate.outcome import judge
from rampe_guard.evaluate.points import figures, pool
from rampe_guard.evaluate.score import LevelScore, score_zone, total
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.runtime.stopping import StopFlag
from tests.support.arms import slider
from tests.unit.test_score_referee import WallAtOne

MINUTE = (0.0, 60.0)
Span = tuple[float, float]


def scored(
    contacts: Sequence[Span], alerts: Sequence[tuple[float, float | None]], blind: Sequence[Span]
) -> LevelScore:
    return score_zone(
        [Contact("wall", a, b) for a, b in contacts],
        [AlertSpan("wall", Level.WARNING, a, b) for a, b in alerts],
        "wall",
        Level.WARNING,
        MINUTE,
        np.array(blind).reshape(-1, 2),
    )


@pytest.mark.parametrize("entered", [10.1, 19.0, 20.0])
@pytest.mark.parametrize("alerts", [[], [(9.0, None)]], ids=["no alert", "frozen alert"])
def test_a_contact_while_the_guard_is_blind_is_neither_warned_of_nor_missed(
    entered: float, alerts: list[tuple[float, float | None]]
) -> None:
    found = scored([(entered, 21.0)], alerts, [(10.0, 20.0)])
    assert (found.contacts, found.warned, found.missed, found.unmonitored) == (0, 0, 0, 1)
    assert found.share_at_least(0.0) is None
    assert total([found, found]).unmonitored == 2


def test_a_contact_at_the_last_moment_of_sight_counts() -> None:
    found = scored([(10.0, 21.0)], [(9.0, None)], [(10.0, 20.0)])
    assert found.leads_s == pytest.approx((1.0,))


def test_a_frozen_alert_begins_anew_when_the_guard_sees_again() -> None:
    found = scored([(22.0, 23.0)], [(9.0, 23.0)], [(10.0, 20.0)])
    assert found.leads_s == pytest.approx((2.0,))


def test_blindness_joins_no_alert_however_short_it_is() -> None:
    found = scored([(12.0, 13.0)], [(9.0, 13.0)], [(10.0, 10.3), (11.0, 11.3)])
    assert found.leads_s == pytest.approx((0.7,))


def test_what_was_said_before_blindness_is_no_warning_of_what_comes_after() -> None:
    # it ended with the blindness, 0.4 s before the contact: within the silence that joins
    assert scored([(10.4, 11.0)], [(9.0, 10.3)], [(10.0, 10.3)]).missed == 1
    assert scored([(10.4, 11.0)], [(9.0, 10.3)], []).warned == 1


def test_false_alarms_are_counted_whole_and_by_the_time_in_which_the_guard_monitored() -> None:
    frozen = scored([], [(9.0, 21.0)], [(10.0, 12.0), (15.0, 20.0), (53.0, 80.0)])
    assert (frozen.alarms, frozen.false_alarms) == (1, 1)
    assert frozen.zone_minutes == pytest.approx((60.0 - 2.0 - 5.0 - 7.0) / 60.0)
    assert scored([(11.0, 11.5)], [(9.0, 21.0)], [(10.0, 12.0)]).false_alarms == 0


TENTHS = st.integers(0, 300).map(lambda k: k / 10)


def spans(times: list[float], gap: float) -> list[Span]:
    """Pairs of times as spans that are further apart than ``gap``."""
    found: list[Span] = []
    ordered = sorted(set(times))
    for start, end in zip(ordered[::2], ordered[1::2], strict=False):
        if not found or start > found[-1][1] + gap:
            found.append((start, end))
    return found


@given(*[st.lists(TENTHS, max_size=12)] * 3)
def test_outcomes_agree_with_painting_time(
    contact_times: list[float], alarm_times: list[float], blind_times: list[float]
) -> None:
    contacts, on, blind = spans(contact_times, 0.5), spans(alarm_times, 0.5), spans(blind_times, 0)
    arrays = [np.array(some).reshape(-1, 2) for some in (contacts, on, blind)]
    found = judge(arrays[0], arrays[1], (0.0, 30.0), arrays[2])

    leads = []
    for index, (entered, _) in enumerate(contacts):
        if entered <= 0.0 or any(a < entered <= b for a, b in blind):
            continue
        sight = max([b for _, b in blind if b <= entered], default=-np.inf)
        warned = [a for a in on if a[0] < entered <= a[1] + 0.5]
        # an alarm that froze at the end of sight and was gone when it came back warns of nothing
        warned = [a for a in warned if a[1] > sight or a[0] >= sight]
        before = contacts[index - 1][1] if index else -np.inf
        leads.append(entered - max(warned[0][0], sight, before) if warned else None)
    assert [None if np.isnan(lead) else lead for lead in found.lead_s.tolist()] == leads
    assert found.unmonitored + len(leads) == sum(entered > 0.0 for entered, _ in contacts)

    tick = np.arange(0.0005, 30.0, 0.001)
    inside, alarmed, hidden = (
        np.any([(tick >= a) & (tick < b) for a, b in some] or [tick < 0.0], axis=0)
        for some in (contacts, on, blind)
    )
    outside_s = float((~inside & ~hidden).sum()) * 0.001
    assert found.outside_s == pytest.approx(outside_s, abs=0.02)
    alarmed_s = float((alarmed & ~inside & ~hidden).sum()) * 0.001
    assert found.alarmed_s == pytest.approx(alarmed_s, abs=0.02)
    told = figures(pool([(found, found)]))
    assert told.unmonitored == 2 * found.unmonitored
    assert told.zone_minutes == pytest.approx(2 * (~hidden).sum() * 0.001 / 60.0, abs=0.01)


def test_blindness_keeps_what_a_guard_says_until_it_says_otherwise() -> None:
    blindness = Blindness()
    for time_s, monitoring in enumerate([True, False, False, True, True, False]):
        blindness.take(float(time_s), monitoring=monitoring)
    np.testing.assert_array_equal(blindness.spans, [(1.0, 3.0), (5.0, np.inf)])
    assert blind_s(blindness.spans, (2.0, 9.0)) == pytest.approx(1.0 + 4.0)


def test_how_long_an_arm_was_inside_from_the_first_position_on() -> None:
    window = (2.0, 9.0)
    assert inside_at_first_s(np.array([(2.0, 5.0), (7.0, 8.0)]), window) == pytest.approx(3.0)
    assert inside_at_first_s(np.array([(2.0, np.inf)]), window) == pytest.approx(7.0)
    assert inside_at_first_s(np.array([(2.1, 5.0)]), window) is None
    assert inside_at_first_s(np.zeros((0, 2)), window) is None


def test_nobody_is_asked_what_comes_while_he_is_blind() -> None:
    time_s = np.array([1.0, 2.4, 2.6, 4.5, 5.0, 6.0])
    contacts, blind = np.array([(4.2, 4.3), (6.5, 7.0)]), np.array([(3.5, 4.5)])
    it_came, known = came(time_s, contacts, 1.0, 9.0, blind)
    assert known.tolist() == [True, True, False, True, True, True]
    assert it_came[known].tolist() == [False, False, False, False, True]


def test_a_tally_knows_both() -> None:
    tally = Tally(WallAtOne(), ("wall",))
    for k, value in enumerate([1.5, 1.5, 0.0, 0.0, 1.5, 0.0, 0.0]):
        tally.status(float(k), monitoring=k not in {3, 4})
        tally.position(float(k), np.array([value]))
    assert tally.inside_at_first_s == {"wall": pytest.approx(2.0)}
    assert tally.blind_s == pytest.approx(2.0)
    found = tally.scores(Level.WARNING)["wall"]
    assert (found.contacts, found.unmonitored) == (0, 1)


SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard}
arm:
  urdf: slider.urdf
  actuators:
    - {name: slide, joint: slide, max_velocity: 1.0, limits: {lower: -2, upper: 4}}
scene: scene.yaml
log: {time: t, joystick: {slide: u}, actuators: {slide: q}}
"""
SCENE = """\
margin_m: 0.1
objects:
  - {name: wall, type: box, size: [1, 1, 1], pose: {xyz: [2, 0, 0]}}
  - {name: floor, type: box, size: [1, 1, 1], pose: {xyz: [-1, 0, 0]}}
"""


def replayed(folder: Path, rows: Sequence[str], capsys: pytest.CaptureFixture[str]) -> str:
    """What a replay of a log says in the end, in one line."""
    slider(folder)
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (folder / "site.yaml").write_text(SITE, encoding="utf-8")
    (folder / "log.csv").write_text("\n".join(["t,u,q", *rows]), encoding="utf-8")
    lines = list(
        replay_offline(str(folder / "site.yaml"), str(folder / "log.csv"), StopFlag(), repeats=True)
    )
    assert all(json.loads(line) for line in lines)
    return " ".join(capsys.readouterr().err.split())


def test_a_replay_tells_when_it_was_blind_and_where_the_arm_began(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # from within the margin of the floor towards the wall; 4 s are missing, in which it goes in
    times = [0.05 * k for k in range(60)] + [7.0 + 0.05 * k for k in range(20)]
    rows = [f"{t:.2f},1.0,{-0.32 + 0.3 * t:.4f}" for t in times]
    said = replayed(tmp_path, rows, capsys)
    assert "wall 0 0 0 — — — 0 1" in said
    assert "NOT MONITORING 3." in said
    assert "of 8.0 s: 1 more contact came meanwhile" in said
    assert "entered no keep-out margin after the start while the guard monitored" in said
    assert "inside from the start, which counts as no contact: floor (0." in said
