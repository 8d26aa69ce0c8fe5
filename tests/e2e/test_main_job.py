"""The main job: an operator swings at a crate and is told before he is in its margin."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from rampe_guard.assembly import load_machine
from rampe_guard.settings import Site
from tests.support.contract import Contract
from tests.support.processes import command, until
from tests.support.rig import Sent
from tests.support.station import HANDS_OFF, REST, TO_CRATE, Station

pytestmark = pytest.mark.e2e


def first_inside(site: Site, zone: str, sent: list[Sent]) -> Sent | None:
    """The first position that was put within the margin of ``zone``."""
    sweeper = load_machine(site).sweeper
    for one in sent:
        found = sweeper.sweep(np.array(one.position), np.zeros(len(one.position)))
        if next(z for z in found.zones if z.zone == zone).inside:
            return one
    return None


def test_alert_before_the_zone_then_an_explicit_clear(live: Station) -> None:
    live.calm()
    rig, ears = live.rig, live.ears
    start_s = time.monotonic()
    rig.levers = TO_CRATE
    until(lambda: rig.position[0] < 0.70, 10.0, "swing well inside the crate's margin")
    rig.levers = HANDS_OFF

    inside = first_inside(live.site, "crate", [s for s in rig.sent if s.at_s >= start_s])
    assert inside is not None
    alerts = [a for a in ears.since(start_s, "alert") if a.body["zone"] == "crate"]
    imminent = next(a for a in alerts if a.body["level"] == "imminent")
    assert imminent.at_s < inside.at_s
    body = imminent.body
    assert body["stamp"] < inside.stamp_s
    assert body["state"] == "unacked"
    assert body["quality"] == "good"
    assert body["link"] in {"boom", "stick", "bucket"}
    assert 0.0 < body["time_to_collision_s"] < 2.0
    assert len(body["text"]) <= 60
    assert body["text"].startswith(f"{body['link']} → crate")

    away_s = time.monotonic()
    live.drive_to(REST[0], 0.3)
    clear = ears.wait(
        "alert", lambda b: b["zone"] == "crate" and b["level"] == "clear", 5.0, away_s
    )
    assert clear.body["alert_id"] == body["alert_id"]
    assert clear.body["previous_level"] != "clear"
    assert clear.body["state"] in {"normal", "rtn_unacked"}


def test_the_primitive_is_told_from_start_to_end(live: Station) -> None:
    live.calm()
    start_s = time.monotonic()
    live.drive_to(REST[0] + 0.06, 0.3)
    ended = live.ears.wait("prediction", lambda b: b["event"] == "ended", 5.0, start_s)
    events = [h for h in live.ears.since(start_s, "prediction") if h.at_s <= ended.at_s]
    assert events[0].body["event"] == "started"
    assert {tuple(h.body["category"]) for h in events} == {(1, 0, 0, 0)}
    assert ended.body["displacement"]["swing"] > 0.03
    assert abs(ended.body["displacement"]["boom"]) < 1e-9
    assert ended.body["learned"] is True


def test_heartbeat_beats_and_state_tells_the_late_joiner(live: Station) -> None:
    live.calm()
    live.ears.wait("heartbeat", lambda b: b["status"] == "ok", 10.0, time.monotonic())
    start_s = time.monotonic()
    time.sleep(2.0)
    beats = live.ears.since(start_s, "heartbeat")
    assert 7 <= len(beats) <= 12  # 5 Hz, with room for a busy machine
    assert {b.body["status"] for b in beats} == {"ok"}
    newest = beats[-1].body
    assert newest["loop_ms"]["p50"] > 0.0
    assert newest["rates_hz"]["actuators"] > 10.0

    live.press_on_crate()
    (state,) = live.ears.ask(f"{live.site.keys.base}/state")
    assert state["heartbeat"]["boot_id"] == newest["boot_id"]
    assert "crate" in {a["zone"] for a in state["alerts"]}
    assert state["predictions"][0]["category"] == [-1, 0, 0, 0]
    # the arm may still creep while the question is on its way: a few samples of travel
    assert state["position"]["swing"] == pytest.approx(live.rig.position[0], abs=0.05)
    alive = f"{live.site.keys.base}/alive"
    assert live.ears.tokens(alive) == [alive]
    live.calm()


def test_an_active_alert_repeats_at_5_hz_and_can_be_acknowledged(live: Station) -> None:
    live.calm()
    live.press_on_crate()
    start_s = time.monotonic()
    time.sleep(1.5)
    repeats = [a.body for a in live.ears.since(start_s, "alert") if a.body["zone"] == "crate"]
    assert 4 <= len(repeats) <= 9
    alert_id = repeats[-1]["alert_id"]

    refused = command(
        *("shelve", live.site_path, alert_id, "--who", "tester", "--for", "5"),
        *("--connect", live.endpoint),
    )
    assert refused.returncode == 2
    assert "imminent is never shelved" in refused.stderr
    acked_s = time.monotonic()
    args = ("ack", live.site_path, alert_id, "--who", "tester", "--connect", live.endpoint)
    done = command(*args)
    assert done.returncode == 0, done.stderr
    acked = live.ears.wait("alert", lambda b: b["acked_by"] == "tester", 2.0, acked_s)
    assert acked.body["state"] == "acked"
    assert acked.body["level"] == "imminent"
    again = command(*args)
    assert again.returncode == 2
    assert alert_id in again.stderr
    assert "Traceback" not in again.stderr
    live.calm()


def test_everything_heard_keeps_the_contract(live: Station, contract: Contract) -> None:
    (state,) = live.ears.ask(f"{live.site.keys.base}/state")
    bodies = [h.body for h in live.ears.all()] + [state]
    assert {b["schema"] for b in bodies} == {
        "rampe.alert.v1",
        "rampe.prediction.v1",
        "rampe.heartbeat.v1",
        "rampe.state.v1",
    }
    for body in bodies:
        contract.check(body)
    assert len({h.body["boot_id"] for h in live.ears.all()}) == 1
    for topic in ("alert", "prediction", "heartbeat"):
        seqs = [h.body["seq"] for h in live.ears.since(0.0, topic)]
        gaps = [b - a for a, b in itertools.pairwise(seqs)]
        assert set(gaps) <= {1}, f"{topic} lost or repeated a number: {seqs}"
