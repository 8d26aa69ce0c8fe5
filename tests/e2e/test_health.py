"""A real guard's metrics, log, floods, stand-stills, and how its end is told: one station."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families
from ruamel.yaml import YAML

from tests.support import processes
from tests.support.contract import Contract
from tests.support.processes import BENCH, ROOT, Process
from tests.support.station import AT_CRATE, TO_CRATE, Station, station

pytestmark = pytest.mark.e2e

PROMETHEUS = ROOT / "deploy" / "prometheus"
GRAFANA = ROOT / "deploy" / "grafana" / "dashboard.json"
OPTIONS = ("--metrics", "0", "--log-format", "json")
METRIC = re.compile(r"\b(?:rampe_guard|process)_[a-z_]+")
WITH_OBJECTS = {"rampe_guard_object_placed", "rampe_guard_object_rejected_total"}
"""Of scenes that move; the bench has none. tests/unit/test_metrics.py sees them."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with station(tmp_path_factory.mktemp("health"), BENCH, *OPTIONS) as made:
        yield made
    made.guard.close()  # the last test starts one of its own


def said(guard: Process) -> list[dict[str, Any]]:
    """Its log; every line of it must be JSON."""
    return [json.loads(line) for line in guard.err.splitlines()]


def scrape(guard: Process) -> str:
    (url,) = {line["fields"]["url"] for line in said(guard) if line["text"].startswith("metrics")}
    with urllib.request.urlopen(url, timeout=5.0) as answer:  # noqa: S310 - of our own guard
        return str(answer.read().decode())


def samples(text: str) -> dict[str, float]:
    return {
        s.name + "".join(f"|{k}={v}" for k, v in sorted(s.labels.items())): s.value
        for family in text_string_to_metric_families(text)
        for s in family.samples
    }


def test_metrics_and_heartbeat_say_the_same(place: Station, contract: Contract) -> None:
    place.rig.lever(b"rubbish")
    place.ears.wait("heartbeat", lambda b: "bad_json" in b["rejected"].get("joystick", {}), 5.0, 0)
    found = samples(scrape(place.guard))
    number = found["rampe_guard_heartbeats_total"]
    beat = place.ears.wait("heartbeat", lambda b: b["seq"] == number, 5.0, 0.0).body
    contract.check(beat)
    told = {
        "turns_total": beat["tick"],
        "uptime_seconds": beat["uptime_s"],
        "overruns_total": beat["drops"],
        "loop_seconds_count": beat["steps"],
        "situations": beat["memory"]["situations"],
        "categories": beat["learned"]["categories"],
        "save_failures_total": beat["save_failures"],
        "router_connected": beat["router"],
        "canary_ok": beat["canary"]["result"] == "ok",
        "input_rate_hertz|input=joystick": beat["rates_hz"]["joystick"],
        "input_rejected_total|input=joystick|reason=bad_json": 1,
        **{f"input_accepted_total|input={k}": n for k, n in beat["accepted"].items()},
        **{f"primitives_total|outcome={k}": n for k, n in beat["primitives"].items()},
        **{f"reason|code={r['code']}": 1 for r in beat["reasons"]},
        **{f"status|status={s}": s == beat["status"] for s in ("ok", "degraded", "not_monitoring")},
    }
    assert {name: found.get(f"rampe_guard_{name}") for name in told} == told
    assert found["process_resident_memory_bytes"] == pytest.approx(
        beat["resources"]["rss_bytes"], rel=0.1
    )


def test_rules_and_dashboard_use_metrics_that_exist(place: Station) -> None:
    exist = {name.partition("|")[0] for name in samples(scrape(place.guard))}
    # those that have no sample yet are there by their type
    exist |= set(re.findall(r"^# TYPE (\S+)", scrape(place.guard), re.MULTILINE)) | WITH_OBJECTS
    rules = YAML(typ="safe").load((PROMETHEUS / "rules.yaml").read_text("utf-8"))
    expressions = [rule["expr"] for group in rules["groups"] for rule in group["rules"]]
    board = json.loads(GRAFANA.read_text("utf-8"))
    expressions += [t["expr"] for panel in board["panels"] for t in panel["targets"]]
    used = {name for expression in expressions for name in METRIC.findall(expression)}
    assert len(used) > 20
    assert used - exist == set()


@pytest.mark.skipif(shutil.which("promtool") is None, reason="promtool is not installed")
@pytest.mark.parametrize(
    "arguments", [("check", "config", "prometheus.yml"), ("test", "rules", "rules.test.yaml")]
)
def test_rules_do_what_they_should(arguments: tuple[str, str, str]) -> None:
    done = subprocess.run(
        ["promtool", *arguments],  # noqa: S607 - wherever it is
        cwd=PROMETHEUS, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_flood_neither_hides_a_collision_nor_stops_the_heartbeat(
    place: Station, tmp_path: Path
) -> None:
    place.calm()
    place.press_on_crate()
    args = ["-m", "tests.support.flood", place.endpoint, str(BENCH), "joystick", "--rate", "5000"]
    with Process(tmp_path, "flood", args, talk=True) as flood:
        flood.wait_for("flooding", 30.0)
        place.rig.joystick_on = False  # the flood has the lever pushed to the crate, too
        began_s = time.monotonic()
        beat = place.ears.wait(
            "heartbeat", lambda b: "overload" in [r["code"] for r in b["reasons"]], 10.0, began_s
        )
        time.sleep(1.5)
        assert flood.popen.stdin is not None
        flood.popen.stdin.close()
        flood.popen.wait(20.0)
        ended_s = time.monotonic()
    assert beat.body["status"] == "degraded"
    (reason,) = [r for r in beat.body["reasons"] if r["code"] == "overload"]
    assert reason["key"] == place.site.keys.joystick
    heard = [h for h in place.ears.all() if beat.at_s <= h.at_s <= ended_s]
    beats = [h for h in heard if h.topic == "heartbeat"]
    assert len(beats) >= 5
    assert {h.body["status"] for h in beats} == {"degraded"}
    rates = [h.body["rates_hz"]["joystick"] for h in beats]
    assert max(rates) <= 1300.0  # a thousand, and the burst
    alerts = [h.body for h in heard if h.topic == "alert" and h.body["zone"] == "crate"]
    assert {a["level"] for a in alerts} == {"imminent"}
    assert max(h.body["input_age_s"]["actuators_s"] for h in beats) < 1.0
    lost = samples(scrape(place.guard))
    name = "rampe_guard_input_rejected_total|input=joystick|reason=overload"
    assert lost[name] > 1000
    place.rig.joystick_on, place.rig.stalled = True, False
    place.calm()
    place.ears.wait("heartbeat", lambda b: b["status"] == "ok", 15.0, ended_s)


def test_a_guard_that_was_frozen_says_for_how_long(place: Station) -> None:
    worker = processes.guarding(place.guard)
    os.kill(worker, signal.SIGSTOP)
    time.sleep(1.6)
    os.kill(worker, signal.SIGCONT)
    thawed_s = time.monotonic()
    beat = place.ears.wait(
        "heartbeat", lambda b: "stalled" in [r["code"] for r in b["reasons"]], 5.0, thawed_s
    ).body
    assert beat["status"] != "ok"


def test_what_nobody_had_seen_is_told_after_supervisor_and_guard_were_killed(
    place: Station,
) -> None:
    place.calm()
    place.drive_to(AT_CRATE[0], 0.3)
    place.rig.levers = TO_CRATE
    began_s = time.monotonic()
    place.ears.wait(
        "alert",
        lambda b: b["zone"] == "crate" and b["source"] == "contact" and b["state"] == "unacked",
        10.0,
        began_s,
    )
    place.rig.stalled = True
    folder = place.guard._err_path.parent
    time.sleep(0.3)  # longer than a small file needs to the disk
    processes.kill_guard(place.guard)
    killed_s = time.monotonic()
    place.guard = processes.guard(folder, BENCH, place.endpoint, *OPTIONS)
    told = place.ears.wait("alert", lambda b: b["source"] == "system", 10.0, killed_s).body
    assert (told["level"], told["state"]) == ("caution", "unacked")
    assert re.match(r"guard restarted after a kill; unseen: \S+ at crate", told["text"])
    done = processes.command(
        *("ack", BENCH, told["alert_id"], "--who", "anna\nroot", "--connect", place.endpoint)
    )
    assert done.returncode == 0, done.stderr
    place.guard.wait_for("ack by anna", 5.0)
    (line,) = [x for x in said(place.guard) if x["text"].startswith("ack by")]
    assert line["fields"]["who"] == r"anna\x0aroot"
