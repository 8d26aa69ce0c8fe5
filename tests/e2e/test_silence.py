"""Silence of an input is told within a second of its time-out, and nothing reads as clear."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.contract import Contract
from tests.support.ears import Ears
from tests.support.processes import BENCH, ROOT, Process
from tests.support.rig import Rig
from tests.support.station import REST, TIMEOUT_S, Station

pytestmark = pytest.mark.e2e

NOTICE_S = 1.0
"""How long after its time-out a silence may go untold."""


@pytest.mark.parametrize("silent", ["joystick", "actuators"])
def test_silence_freezes_the_alerts_and_says_not_monitoring(
    live: Station, silent: str, contract: Contract
) -> None:
    live.calm()
    live.press_on_crate()
    rig, ears = live.rig, live.ears
    key = getattr(live.site.keys, silent)
    setattr(rig, f"{silent}_on", False)
    silent_s = time.monotonic()

    beat = ears.wait("heartbeat", lambda b: b["status"] == "not_monitoring", 5.0, silent_s)
    assert beat.at_s - silent_s <= TIMEOUT_S + NOTICE_S
    assert [r["key"] for r in beat.body["reasons"] if r["code"] == f"{silent}_silent"] == [key]
    system = ears.wait("alert", lambda b: b["source"] == "system", 2.0, silent_s)
    assert system.at_s - silent_s <= TIMEOUT_S + NOTICE_S
    assert system.body["zone"] is None
    assert system.body["level"] == "warning"
    assert system.body["state"] == "unacked"
    assert system.body["text"].startswith("NOT MONITORING: ")
    assert silent in system.body["text"]

    shelve_for_a_while(live, system.body["alert_id"], contract)

    time.sleep(1.0)
    frozen = [h.body for h in ears.since(beat.at_s + 0.1, "alert") if h.body["source"] != "system"]
    assert len(frozen) >= 3  # republished at 5 Hz
    assert {b["quality"] for b in frozen} == {"stale"}
    shown = {(b["zone"], b["level"]) for b in frozen}
    assert ("crate", "imminent") in shown
    assert len(shown) == len({zone for zone, _ in shown})  # no level changes any more
    beats = [h.body["status"] for h in ears.since(beat.at_s, "heartbeat")]
    assert set(beats) == {"not_monitoring"}

    back_s = time.monotonic()
    setattr(rig, f"{silent}_on", True)
    ears.wait("heartbeat", lambda b: b["status"] == "ok", 5.0, back_s)
    ears.wait("alert", lambda b: b["zone"] == "crate" and b["quality"] == "good", 2.0, back_s)
    gone = ears.wait(
        "alert", lambda b: b["source"] == "system" and b["level"] == "clear", 4.0, back_s
    )
    assert gone.body["state"] == "rtn_unacked"  # latched until somebody has seen it
    done = processes.command(
        *("ack", live.site_path, gone.body["alert_id"], "--who", "tester"),
        *("--connect", live.endpoint),
    )
    assert done.returncode == 0, done.stderr
    acked = ears.wait("alert", lambda b: b["acked_by"] == "tester", 2.0, gone.at_s)
    assert acked.body["state"] == "normal"
    live.calm()


def shelve_for_a_while(live: Station, alert_id: str, contract: Contract) -> None:
    """Silence an alert and end its silence: told to all, and to who comes late."""
    ears, base = live.ears, live.site.keys.base

    def wish(duration_s: float, alert: str = alert_id) -> bytes:
        return json.dumps({"alert_id": alert, "who": "tester", "duration_s": duration_s}).encode()

    start_s = time.monotonic()
    assert "at most 30 s" in ears.refusal(f"{base}/shelve", wish(31.0))
    assert "'nobody' is shown" in ears.refusal(f"{base}/shelve", wish(5.0, "nobody"))
    assert "duration_s" in ears.refusal(f"{base}/shelve", wish(-1.0))
    (shelved,) = ears.ask(f"{base}/shelve", wish(20.0))
    contract.check(shelved)
    assert (shelved["inhibit"], shelved["shelved_by"]) == ("shelved", "tester")
    assert shelved["shelved_until_unix_s"] == pytest.approx(time.time() + 20.0, abs=2.0)
    assert (shelved["level"], shelved["state"]) == ("warning", "unacked")
    heard = ears.wait("alert", lambda b: b["inhibit"] == "shelved", 2.0, start_s)
    assert heard.body == shelved
    (state,) = ears.ask(f"{base}/state")
    contract.check(state)
    assert [a["shelved_by"] for a in state["alerts"] if a["alert_id"] == alert_id] == ["tester"]
    levels = [a["level"] for a in state["alerts"]]
    assert levels[:2] == ["imminent", "warning"]  # the gravest first
    done = processes.command(
        *("shelve", live.site_path, alert_id, "--who", "tester", "--for", "0"),
        *("--connect", live.endpoint),
    )
    assert done.returncode == 0, done.stderr
    ended = ears.wait("alert", lambda b: b["inhibit"] == "none", 2.0, heard.at_s)
    assert (ended.body["shelved_by"], ended.body["shelved_until_unix_s"]) == (None, None)


def on_change_site(folder: Path) -> Path:
    """The bench site on keys of its own, with a joystick that speaks only when it moves."""
    text = BENCH.read_text("utf-8")
    for old, new in (
        ("rampe/bench/excavator", "rampe/bench/on-change"),
        ("../../geometry", str(ROOT / "geometry")),
        ("../scenes", str(ROOT / "config" / "scenes")),
        (
            "joystick: {timeout_s: 1.0}",
            "joystick: {timeout_s: 1.0, on_change: true, alive_key: rampe/bench/on-change/lever}",
        ),
        (
            "  actuators: {timeout_s: 1.0}",
            "  actuators: {timeout_s: 1.0}\n  enabled: {timeout_s: 60.0}",
        ),
        (
            "  base: rampe/bench/on-change/guard",
            "  base: rampe/bench/on-change/guard\n  enabled: rampe/bench/on-change/enabled",
        ),
    ):
        assert old in text
        text = text.replace(old, new)
    path = folder / "on-change.yaml"
    path.write_text(text, "utf-8")
    return path


def test_an_on_change_joystick_may_be_silent_while_its_token_lives(
    live: Station, tmp_path: Path, contract: Contract
) -> None:
    site_path = on_change_site(tmp_path)
    site = load_site(site_path)
    lever = ["-m", "tests.support.lever", live.endpoint, site.keys.joystick]
    assert site.keys.joystick_alive is not None
    with (
        Ears(live.endpoint, site.keys.base) as ears,
        Rig(live.endpoint, site, REST) as rig,
        processes.guard(tmp_path, site_path, live.endpoint),
    ):
        rig.joystick_on = False
        # no token yet: whoever should tell of the lever is not there
        ears.wait("heartbeat", lambda b: b["status"] == "not_monitoring", 5.0, 0.0)
        with Process(tmp_path, "lever", [*lever, site.keys.joystick_alive]) as publisher:
            publisher.wait_for("ready")
            start_s = time.monotonic()
            ears.wait("heartbeat", lambda b: b["status"] == "ok", 5.0, start_s)
            quiet_s = time.monotonic()
            time.sleep(2.0 * TIMEOUT_S)
            beats = ears.since(quiet_s, "heartbeat")
            assert {b.body["status"] for b in beats} == {"ok"}
            assert beats[-1].body["input_age_s"]["joystick_s"] > TIMEOUT_S

            killed_s = time.monotonic()
            publisher.popen.kill()
            beat = ears.wait("heartbeat", lambda b: b["status"] == "not_monitoring", 5.0, killed_s)
            assert beat.at_s - killed_s <= NOTICE_S
            assert site.keys.joystick in {r["key"] for r in beat.body["reasons"]}

        # the machine says that it is switched off: no fault any more
        assert site.keys.enabled is not None
        off_s = time.monotonic()
        rig.lever({"enabled": False, "stamp": time.time()}, site.keys.enabled)
        beat = ears.wait(
            "heartbeat", lambda b: [r["code"] for r in b["reasons"]] == ["machine_off"], 2.0, off_s
        )
        assert beat.body["status"] == "not_monitoring"
        assert beat.body["reasons"][0]["key"] == site.keys.enabled
        over = ears.wait("alert", lambda b: b["inhibit"] == "machine_off", 4.0, off_s)
        contract.check(over.body)
        assert (over.body["level"], over.body["state"]) == ("clear", "rtn_unacked")
        assert over.body["text"] == "machine off: not monitoring"
        on_s = time.monotonic()
        rig.lever({"enabled": True}, site.keys.enabled)
        beat = ears.wait("heartbeat", lambda b: "gone" in b["reasons"][0]["code"], 2.0, on_s)
        assert beat.body["status"] == "not_monitoring"
