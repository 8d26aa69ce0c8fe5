"""The screen as an operator reads it: rendered to text, with its styles."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from rich.cells import cell_len

from rampe_guard.client.contact import Contact
from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level
from rampe_guard.view.marks import HATCH
from rampe_guard.view.screen import render
from rampe_guard.view.state import (
    ActuatorView,
    AlertView,
    EventView,
    HealthView,
    ViewState,
)
from tests.support.rendered import line_of, shown

NOW = 100.0
ACTUATORS = (
    ActuatorView("swing", "rad", None, None, 0.42, 0.55, 0.9, 1, 0.71, 0.12, 1.13),
    ActuatorView("boom", "m", 0.0, 1.3, 0.81, 0.02, 0.2, 1, 0.1, 0.05, 0.91),
    ActuatorView("stick", "m", 0.0, 1.6, 1.31, -0.001, 0.0, 0, 0.0, 0.0, 1.31),
    ActuatorView("bucket", "m", 0.0, 1.1, 0.92, -0.3, -0.5, -1, -0.4, 0.1, 0.52),
)
HEALTH = HealthView(Protection.MONITORING, (), "b", 0.012, 0.008, 1.1, 4.2, 0.8, 3.1)
ALERTS = (
    AlertView("1", "silo", Level.CAUTION, link="stick", time_to_collision_s=3.42, sent_s=NOW),
    AlertView(
        "2",
        "power-line",
        Level.IMMINENT,
        source="stopping",
        link="bucket",
        time_to_collision_s=0.48,
        probability=1.0,
        sent_s=NOW,
    ),
    AlertView(
        "3",
        "wall",
        Level.WARNING,
        link="bucket",
        time_to_collision_s=1.49,
        probability=0.83,
        sent_s=NOW,
    ),
)
EVENTS = (EventView(NOW - 2.8, Level.IMMINENT, "wall: entered; warned 0.84 s ahead"),)
STATE = ViewState(
    *("excavator-7", "quarry-north", NOW, ACTUATORS, 12, NOW, NOW, NOW, HEALTH, ALERTS, EVENTS),
    contact=Contact(beat_s=NOW - 0.1),
)
CALM = replace(STATE, alerts=())


@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize(
    "state",
    [
        STATE,
        CALM,
        replace(STATE, now_s=NOW + 9.0),
        replace(STATE, events=EVENTS * 50),
        replace(STATE, health=replace(HEALTH, protection=Protection.NOT_MONITORING)),
        replace(STATE, machine="m" * 200, site="電" * 200),
    ],
)
def test_every_state_fits_the_terminal(state: ViewState, width: int) -> None:
    lines = shown(render(state, width, 24), width).splitlines()
    assert len(lines) <= 24
    assert all(cell_len(line) <= width for line in lines)


def test_position_speed_lever_and_forecast_stand_on_the_actuators_line() -> None:
    swing = line_of(shown(render(STATE)), "swing")
    for part in ("0.42 rad", "+0.55", "+90%", "→", "+0.71 ± 0.12"):
        assert part in swing
    assert re.search("●━*▷", swing)
    assert re.search("◁━*●", line_of(shown(render(STATE)), "bucket "))
    stick = line_of(shown(render(STATE)), "stick ")
    assert "-0.00" not in stick
    assert "—" in stick


def test_alerts_are_sorted_by_urgency_with_shape_and_word() -> None:
    lines = shown(render(STATE)).splitlines()
    rows = [i for i, line in enumerate(lines) if " → " in line and "in " in line]
    assert [lines[i].split()[:2] for i in rows] == [
        ["■", "IMMINENT"],
        ["△", "WARNING"],
        ["◇", "caution"],
    ]
    assert "bucket → wall" in lines[rows[1]]
    assert "83%" in lines[rows[1]]


def test_time_to_collision_is_rounded_down() -> None:
    text = shown(render(STATE))
    assert "in 0.4 s" in line_of(text, "power-line")
    assert "in 1.4 s" in line_of(text, "→ wall")
    now = replace(ALERTS[1], time_to_collision_s=0.06)
    assert " now " in line_of(shown(render(replace(STATE, alerts=(now,)))), "power-line")


def test_normal_is_grey_and_says_none() -> None:
    text = shown(render(replace(CALM, events=())), styles=True)
    assert "monitoring" in text
    assert " none" in text
    assert "48;2" not in text  # no coloured background anywhere
    assert "38;2" not in text.replace("38;5", "")


def test_nothing_is_ever_green() -> None:
    for state in (STATE, CALM, replace(STATE, now_s=NOW + 9)):
        codes = re.findall(r"\x1b\[([\d;]*)m", shown(render(state), styles=True))
        assert not any(code.split(";")[-1] in {"32", "92", "42", "102"} for code in codes)


@pytest.mark.parametrize(
    ("state", "headline", "reason"),
    [
        (
            replace(
                CALM,
                health=replace(
                    HEALTH, protection=Protection.NOT_MONITORING, reasons=("joystick silent",)
                ),
            ),
            "NOT MONITORING",
            "joystick silent",
        ),
        (replace(CALM, now_s=NOW + 3.4), "PROTECTION UNAVAILABLE", "for 3.5 s"),
        (
            replace(CALM, health=None, contact=Contact()),
            "PROTECTION UNAVAILABLE",
            "no message from the guard yet",
        ),
    ],
)
def test_no_protection_is_unmissable_and_never_reads_as_no_alert(
    state: ViewState, headline: str, reason: str
) -> None:
    text = shown(render(state))
    assert text.count(headline) == 2
    assert reason in text
    assert "unknown" in text
    assert not re.search(r"^ none\s*$", text, re.MULTILINE)
    styled = line_of(shown(render(state), styles=True), f"✕  {headline}")
    assert "48;2;139;0;139" in styled  # in the bright half of its pulse
    assert HATCH * 3 in styled


def test_a_heartbeat_just_within_its_time_still_counts() -> None:
    assert replace(CALM, now_s=NOW + 0.9).protection is Protection.MONITORING
    assert replace(CALM, now_s=NOW + 0.91).protection is Protection.UNAVAILABLE


def test_an_alert_not_repeated_stays_and_is_called_stale() -> None:
    old = replace(ALERTS[1], sent_s=NOW - 2.0)
    row = line_of(shown(render(replace(STATE, alerts=(old,)))), "power-line")
    assert "■ IMMINENT" in row
    assert "STALE 2 s" in row


def test_stale_positions_say_so() -> None:
    assert "STALE" in shown(render(replace(CALM, position_received_s=NOW - 1.5)))
    assert "STALE" not in shown(render(CALM))
    bare = tuple(ActuatorView(a.name, a.unit) for a in ACTUATORS)
    assert shown(render(replace(CALM, actuators=bare))).count("no position") == 4


def test_no_forecast_is_drawn_while_nobody_monitors() -> None:
    lost = replace(CALM, health=replace(HEALTH, protection=Protection.NOT_MONITORING))
    assert "▷" not in shown(render(lost))
    assert "no prediction" in shown(render(lost))


def test_degraded_shows_its_reason_and_keeps_monitoring() -> None:
    health = replace(HEALTH, protection=Protection.DEGRADED, reasons=("2 messages refused",))
    text = shown(render(replace(CALM, health=health)))
    assert "△ DEGRADED" in text
    assert "2 messages refused" in text
    assert re.search(r"^ none\s*$", text, re.MULTILINE)


def test_doubtful_seen_and_finished_alerts_are_marked() -> None:
    def remark(alert: AlertView) -> str:
        return line_of(shown(render(replace(STATE, alerts=(alert,)))), "power-line")

    assert "DOUBTFUL" in remark(replace(ALERTS[1], trusted=False))
    assert "seen" in remark(replace(ALERTS[1], attention=False))
    assert "acknowledge" in remark(replace(ALERTS[1], gone=True))


def flashes(alert: AlertView, after_s: float) -> bool:
    """Its shape is there now, and is not ``after_s`` later."""

    def row(now_s: float) -> str:
        state = replace(STATE, alerts=(replace(alert, sent_s=now_s),), now_s=now_s)
        return line_of(shown(render(state)), alert.zone)

    return row(NOW).split()[0] != row(NOW + after_s).split()[0]


def test_only_what_nobody_has_seen_flashes_and_each_level_at_its_own_rate() -> None:
    imminent, warning, caution = ALERTS[1], ALERTS[2], ALERTS[0]
    assert flashes(imminent, 0.13)
    assert not flashes(warning, 0.13)
    assert flashes(warning, 0.51)
    assert not any(flashes(caution, after / 10) for after in range(20))
    for quiet in ({"attention": False}, {"gone": True}, {"inhibit": "shelved"}):
        assert not flashes(replace(imminent, **quiet), 0.13)


def test_a_shelved_alert_says_by_whom_and_for_how_long_and_has_no_colour() -> None:
    shelved = replace(ALERTS[2], inhibit="shelved", shelved_by="ann", shelved_for_s=20.0)
    state = replace(STATE, alerts=(shelved,), now_s=NOW + 0.5)
    row = line_of(shown(render(state), styles=True), "wall")
    assert "shelved by ann, 20 s left" in row
    assert "\x1b[1;33m" not in row


def test_a_machine_that_is_off_is_grey_and_never_reads_as_monitoring() -> None:
    state = replace(CALM, health=replace(HEALTH, protection=Protection.MACHINE_OFF))
    text = shown(render(state), styles=True)
    assert "○ machine off" in text
    assert "switched off: not watched" in text
    assert "none: the machine is off" in text
    assert "monitoring" not in text
    assert "48;2" not in text


def test_an_alert_does_not_move_the_events() -> None:
    def row_of_events(state: ViewState) -> int:
        lines = shown(render(state)).splitlines()
        return next(i for i, line in enumerate(lines) if "── events" in line)

    assert len({row_of_events(replace(STATE, alerts=ALERTS[:n])) for n in range(4)}) == 1


def test_a_position_beyond_its_limit_is_drawn_at_the_edge() -> None:
    boom = replace(ACTUATORS[1], position=1.4, sign=0)
    assert "»" in line_of(shown(render(replace(CALM, actuators=(boom,)))), "boom")
    swing = replace(ACTUATORS[0], position=3 * 3.1416, sign=0)  # endless: drawn within one turn
    assert "●" in line_of(shown(render(replace(CALM, actuators=(swing,)))), "swing")


def test_an_alert_of_memory_says_in_how_many_similar_situations_it_came_to_contact() -> None:
    known = replace(ALERTS[2], source="next", times=(6, 8))
    assert "next: 6 of 8" in line_of(shown(render(replace(STATE, alerts=(known,)))), "→ wall")
    seen = replace(known, attention=False, acked_by="anna")
    text = line_of(shown(render(replace(STATE, alerts=(seen,)))), "→ wall")
    assert "next: 6 of 8 · seen by a" in text
