"""The scene is replaced, and what was learned is forgotten, while a guard works."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from rampe_guard.recording import McapReading
from rampe_guard.recording.recorded_site import other_files, recorded_site
from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.processes import BENCH, called, until
from tests.support.station import HANDS_OFF, Station

pytestmark = pytest.mark.e2e

WHO = "Ann"
OWN = Path(load_site(BENCH).scene.path)


def limit(swing: float, name: str = "fence", side: str = "above") -> str:
    """A scene of one limit of the swing, above or below ``swing`` [rad]."""
    item = f"{{name: {name}, type: actuator_limit, actuator: swing, {side}: {swing}}}"
    return f"objects:\n  - {item}\n"


def key(live: Station, word: str) -> str:
    return f"{live.site.keys.base}/{word}"


def put(live: Station, text: str, who: str = WHO) -> dict[str, Any]:
    payload = json.dumps({"scene": text, "who": who}).encode()
    (answer,) = live.ears.ask(key(live, "scene/put"), payload)
    return answer


def in_force(live: Station) -> dict[str, Any]:
    (answer,) = live.ears.ask(key(live, "scene"))
    return answer


def test_the_site_s_own_scene_is_shown(live: Station) -> None:
    put(live, OWN.read_text("utf-8"))
    shown = in_force(live)
    beat = live.ears.wait("heartbeat", lambda _: True, 5.0, time.monotonic())
    assert shown["scene"] == OWN.read_text("utf-8")
    assert shown["scene_hash"] == beat.body["scene_hash"] == live.site.scene.content_hash
    assert {"crate", "ceiling", "slew-left", "slew-right"} <= set(shown["zones"])


def test_another_scene_is_swept_at_once_and_alerts_of_the_old_one_end(live: Station) -> None:
    put(live, OWN.read_text("utf-8"))
    live.calm()
    live.press_on_crate()
    start_s = time.monotonic()
    # the crate goes, and a limit comes just before the swing, which is still pushed down
    told = put(
        live, "objects:\n  - {name: low, type: actuator_limit, actuator: swing, below: 0.79}\n"
    )
    assert (told["put_by"], told["kept"], told["scene"]) == (WHO, True, None)
    assert "low" in told["zones"]
    raised = live.ears.wait("alert", lambda b: b["zone"] == "low", 2.0, start_s)
    assert raised.body["level"] == "imminent"
    ended = live.ears.wait(
        "alert", lambda b: b["zone"] == "crate" and b["level"] == "clear", 5.0, start_s
    )
    assert ended.body["quality"] == "good"
    beat = live.ears.wait("heartbeat", lambda _: True, 2.0, time.monotonic())
    assert beat.body["scene_hash"] == told["scene_hash"] != live.site.scene.content_hash
    until(lambda: f"scene/put by {WHO}" in live.guard.err, 5.0, "a line of the log")
    live.rig.stalled, live.rig.levers = False, HANDS_OFF


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("objects:\n  - {name: x, type: actuator_limit, actuator: arm, above: 1}\n", "arm"),
        ("objects: [{name: x, type: mesh, file: ../../../../etc/passwd}]\n", "passwd"),
        ("objects: [{name: x, type: sphere, radius_m: .nan, center: [0, 0, 0]}]\n", "radius_m"),
        ("a: &a [1]\nb: *a\n", "anchor"),
        ("\x00", "<scene>"),
    ],
)
def test_a_wrong_scene_is_refused_with_its_error_and_the_old_one_stays(
    live: Station, text: str, said: str
) -> None:
    before = in_force(live)["scene_hash"]
    payload = json.dumps({"scene": text, "who": WHO}).encode()
    assert said in live.ears.refusal(key(live, "scene/put"), payload)
    assert in_force(live)["scene_hash"] == before


def test_every_refusal_is_a_line_with_its_name_and_counted(live: Station) -> None:
    for k in range(8):
        wish = json.dumps({"operator": "nobody", "who": f"Eve-{k}"}).encode()
        live.ears.refusal(key(live, "forget"), wish)
    until(
        lambda: all(f"forget by Eve-{k}: refused" in live.guard.err for k in range(8)),
        5.0,
        "a line each",
    )
    beat = live.ears.wait("heartbeat", lambda b: b["commands"]["refused"], 5.0, time.monotonic())
    assert beat.body["commands"]["refused"]["forget"] >= 8


def test_only_the_exact_key_replaces_a_scene(live: Station) -> None:
    before = in_force(live)["scene_hash"]
    payload = json.dumps({"scene": limit(0.5), "who": WHO}).encode()
    assert "scene/put" in live.ears.refusal(key(live, "scene"), payload)
    for pattern in (key(live, "scene/*"), "rampe/**/put"):
        replies = list(live.ears.session.get(pattern, payload=payload, timeout=5.0))
        assert [r.err is not None for r in replies] == [True]
    assert in_force(live)["scene_hash"] == before
    until(lambda: "asked on 'rampe" in live.guard.err, 5.0, "the refusal in the log")


def test_a_guard_that_is_killed_comes_back_with_the_scene_that_was_put(
    live: Station, tmp_path: Path
) -> None:
    file = tmp_path / "new.yaml"
    file.write_text(limit(1.31, "by-hand"), "utf-8")
    args = (str(live.site_path), "--connect", live.endpoint)
    done = called("scene", "put", *args, file, "--who", "Ben")
    assert done.returncode == 0, done.stderr
    assert "put by Ben" in done.stdout
    before = in_force(live)
    start_s = time.monotonic()
    os.kill(processes.guarding(live.guard), signal.SIGKILL)
    boot_id = live.ears.all()[-1].body["boot_id"]
    live.ears.wait("heartbeat", lambda b: b["boot_id"] != boot_id, 30.0, start_s)
    assert in_force(live) == before
    shown = called("scene", "show", *args)
    assert shown.stdout == file.read_text("utf-8")
    assert "put by Ben" in shown.stderr
    # the site's own file is the way back, and needs nothing kept
    assert called("scene", "put", *args, OWN).returncode == 0
    assert in_force(live)["scene_hash"] == live.site.scene.content_hash


def test_a_recorder_goes_on_in_a_file_that_explains_the_other_scene(
    live: Station, tmp_path: Path
) -> None:
    begun = put(live, limit(1.33))  # not the one of the site file
    out = tmp_path / "work.mcap"
    args = ["-m", "rampe_guard", "record", str(live.site_path), str(out)]
    with processes.Process(tmp_path, "recorder", [*args, "--connect", live.endpoint]) as recorder:
        recorder.wait_for("recording bench-excavator")
        live.ears.wait("recorder", lambda b: b["messages"] > 0, 10.0, time.monotonic())
        told = put(live, limit(1.32))
        start_s = time.monotonic()
        live.ears.wait("recorder", lambda b: b["files"] == 2, 10.0, start_s)
        time.sleep(1.0)
        recorder.signal_and_wait(signal.SIGTERM)
    put(live, OWN.read_text("utf-8"))
    hashes = []
    for file in (out, tmp_path / "work-0002.mcap"):
        reading = McapReading(file)
        assert reading.warnings == ()
        with recorded_site(reading) as site:
            hashes.append(site.scene.content_hash)
    assert hashes == [begun["scene_hash"], told["scene_hash"]]
    assert other_files(McapReading(tmp_path / "work-0002.mcap")) == ()


def test_what_was_learned_is_forgotten(live: Station) -> None:
    live.calm()
    for _ in range(2):
        live.drive_to(1.15)
        live.drive_to(1.0)
    live.calm()
    args = (str(live.site_path), "--connect", live.endpoint)
    refused = called("model", "reset", *args, "--running", "--operator", "Zoe")
    assert refused.returncode == 2
    assert "'Zoe' is not at the levers" in refused.stderr
    done = called("model", "reset", *args, "--running", "--who", WHO)
    assert done.returncode == 0, done.stderr
    assert "forgotten: operator 'operator'" in done.stdout
    until(
        lambda: f"forget by {WHO}" in live.guard.err,
        5.0,
        "a line of the log, which a thread writes",
    )
    start_s = time.monotonic()
    beat = live.ears.wait("heartbeat", lambda _: True, 2.0, start_s)
    assert beat.body["memory"]["situations"] < 20  # only what was seen since
