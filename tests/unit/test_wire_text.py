"""The line on the cab display."""

from __future__ import annotations

import pytest

from rampe_guard.wire import MAX_TEXT, alert_text, in_full


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("bucket", "cab-wall", 1.42), "bucket → cab-wall in 1.4 s"),
        (("bucket", "cab-wall", 2.3), "bucket → cab-wall in 2.3 s"),
        (("bucket", "cab-wall", 1.99), "bucket → cab-wall in 1.9 s"),
        (("bucket", "cab-wall", 0.09), "bucket → cab-wall now"),
        (("bucket", "cab-wall", 100.0), "bucket → cab-wall in >99 s"),
        (("bucket", "cab-wall", None), "bucket → cab-wall, time unknown"),
        (("bucket", "cab-wall", float("inf")), "bucket → cab-wall, time unknown"),
        ((None, "road-side", 1.0), "arm → road-side in 1.0 s"),
        (("bucket", "cab-wall", 0.0, "imminent", "contact"), "bucket at cab-wall now"),
        (("bucket", "cab-wall", None, "clear"), "bucket clear of cab-wall now"),
        ((None, "joystick silent", None, "warning", "system"), "NOT MONITORING: joystick silent"),
        ((None, "joystick silent", None, "clear", "system"), "monitoring again"),
        ((None, "guard restarted", None, "caution", "system"), "guard restarted"),
        (("a\nb", "c", 1.0), "a?b → c in 1.0 s"),
    ],
)
def test_text(arguments: tuple[str | None, str | None, float | None], text: str) -> None:
    assert alert_text(*arguments) == text


def test_memory_explains_itself_on_the_same_line() -> None:
    text = alert_text("bucket", "wall", 1.42, "warning", "next", times=(6, 8))
    assert text == "bucket → wall in 1.4 s, 6 of 8 times"
    text = alert_text("l" * 64, "z" * 64, 3.91, "warning", "next", times=(30, 32))
    assert len(text) == MAX_TEXT
    assert text.endswith("… in 3.9 s, 30 of 32 times")
    assert alert_text("bucket", "wall", None, "clear", "next", times=(0, 8)) == (
        "bucket clear of wall now"
    )


def test_a_suppressed_alert_never_reads_as_clear() -> None:
    text = alert_text("bucket", "cab-wall", None, "clear", "intent", machine_off=True)
    assert text == "bucket → cab-wall: machine off"
    text = alert_text(None, "no joystick", None, "clear", "system", machine_off=True)
    assert text == "machine off: not monitoring"


@pytest.mark.parametrize("level", ["caution", "warning"])
def test_a_log_tells_all_that_a_display_has_no_room_for(level: str) -> None:
    reason = "guard restarted after a power loss or reboot; unseen: bucket at wall\n, arm at truck"
    text = alert_text(None, reason, None, level, "system")
    assert text.endswith("…")
    assert "truck" not in text
    head = "" if level == "caution" else "NOT MONITORING: "
    assert in_full(text, reason) == head + reason.replace("\n", "?")
    short = alert_text(None, "guard restarted after a kill", None, level, "system")
    assert in_full(short, "guard restarted after a kill") == short


def test_who_is_within_a_margin_is_not_clear_of_it() -> None:
    text = alert_text("bucket", "cab-wall", None, "clear", "contact", in_margin=True)
    assert text == "bucket in margin of cab-wall, not nearing"
    assert alert_text("bucket", "wall", 0.0, "imminent", "contact", in_margin=True) == (
        "bucket at wall now"
    )


def test_wide_letters_take_two_cells_of_the_display() -> None:
    text = alert_text("挖斗" * 20, "壁" * 40, 1.4)
    assert text == "挖斗" * 5 + "挖… → " + "壁" * 12 + "… in 1.4 s"


def test_long_names_are_cut_and_the_time_stays() -> None:
    text = alert_text("l" * 64, "z" * 64, 1.4)
    assert len(text) == MAX_TEXT
    assert text.endswith("z… in 1.4 s")
    assert "l… → z" in text


def test_a_short_name_leaves_its_room_to_the_other() -> None:
    assert alert_text("boom", "z" * 40, 1.4) == "boom → " + "z" * 40 + " in 1.4 s"
    assert alert_text("l" * 40, "pole", 1.4) == "l" * 40 + " → pole in 1.4 s"
