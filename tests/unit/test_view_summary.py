"""The closing table."""

from __future__ import annotations

import io

from rich.console import Console

from rampe_guard.view.summary import Summary, ZoneTally, summary


def shown(tally: Summary) -> str:
    console = Console(record=True, width=80, file=io.StringIO())
    console.print(summary(tally))
    return console.export_text()


def row(text: str, zone: str) -> str:
    line = next(line for line in text.splitlines() if line.startswith(zone))
    return " ".join(line.split())


def test_every_figure_has_its_place() -> None:
    text = shown(
        Summary(
            [
                ZoneTally("wall", 3, (0.61, 0.42, 1.2), 1),
                ZoneTally("power-line", 1, (0.9,), 0),
            ],
            duration_s=120.0,
            cycles=12,
            loop_p50_ms=1.1,
            loop_p99_ms=4.2,
        )
    )
    assert row(text, "wall") == "wall 3 3 0 0.42 s 0.61 s 1.20 s 1"
    assert row(text, "all") == "all 4 4 0 0.42 s 0.76 s 1.20 s 1"
    assert "All 4 contacts were warned of, the latest 0.42 s ahead." in text
    assert "12 cycles in 2.0 min" in text
    assert "0.25 false alarms per minute and zone" in text
    assert "1.1 ms p50" in text


def test_a_miss_is_the_headline() -> None:
    text = shown(Summary([ZoneTally("wall", 3, (0.6,), 0)], duration_s=60.0))
    assert "✖ 2 of 3 contacts came without a warning." in text
    assert "All" not in text


def test_a_run_without_contacts_claims_nothing() -> None:
    text = shown(Summary([ZoneTally("wall", 0, (), 0)], duration_s=60.0))
    assert row(text, "wall") == "wall 0 0 0 — — — 0"
    assert "shows nothing about warning" in text


def test_contacts_while_blind_are_their_own_column_and_nobody_claims_all() -> None:
    zones = [ZoneTally("wall", 3, (0.6, 0.5, 0.4), 1, unmonitored=2), ZoneTally("roof", 0, (), 0)]
    text = shown(Summary(zones, duration_s=120.0, blind_s=60.0))
    assert row(text, "wall") == "wall 3 3 0 0.40 s 0.50 s 0.60 s 1 2"
    assert row(text, "all") == "all 3 3 0 0.40 s 0.50 s 0.60 s 1 2"
    said = " ".join(text.split())
    assert "All 3 contacts that came while the guard monitored were warned of" in said
    assert "NOT MONITORING 60.0 of 120.0 s: 2 more contacts came meanwhile" in said
    assert "0.50 false alarms per minute and zone" in said  # of the time in which it monitored
    calm = shown(Summary([ZoneTally("wall", 0, (), 0)], duration_s=120.0, blind_s=0.2))
    assert row(calm, "wall") == "wall 0 0 0 — — — 0"
    assert "NOT MONITORING 0.2 of 120.0 s\n" in calm.replace(" \n", "\n")
    assert "NOT MONITORING" not in shown(Summary(zones, duration_s=120.0))


def test_zones_that_the_arm_began_in_are_named() -> None:
    run = Summary([ZoneTally("wall", 0, (), 0)], 60.0, inside_at_first_s={"wall": 3.21, "a": 60.0})
    said = " ".join(shown(run).split())
    assert "no contact: wall (3.2 s), a (60.0 s, to the end)" in said
    assert "entered no keep-out margin after the start" in said


def test_contacts_without_an_answer_are_told() -> None:
    text = shown(Summary([ZoneTally("wall", 1, (0.5,), 0, unknown_contacts=1)], duration_s=60.0))
    assert "1 contacts rest on sweeps without an answer" in text


def test_no_time_and_no_zones_are_no_error() -> None:
    assert "all" in shown(Summary([], duration_s=0.0))
