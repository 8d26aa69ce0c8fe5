"""What a flood of messages does to a guard. Real processes on loopback.

``python -m tests.benchmarks.overload [--seconds 10] [--rate 10000] [--json]``

A router, a guard of the bench site and a machine that pushes against a crate, so that an alert
stands all the time. Then another process publishes joystick messages, actuator messages, both, or
asks for the guard's state, ``--rate`` times a second. An alert carries the stamp of the position
that it was computed from: its latency is its arrival here less that stamp. A heartbeat is due
every 200 ms.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.ears import Ears, Heard
from tests.support.processes import BENCH, Process
from tests.support.rig import Rig
from tests.support.station import AT_CRATE

KINDS = ("none", "joystick", "actuators", "both", "state")
SETTLE_S = 2.0


@dataclass(frozen=True)
class Result:
    """Figures of one flood; times in [ms], rates in [1/s]."""

    flood: str
    came_hz: float
    looked_at_hz: float
    not_looked_at_hz: float
    overruns: int
    steps_hz: float
    cpu_share: float
    alerts: int
    alert_p50_ms: float
    alert_p99_ms: float
    beat_gap_max_ms: float
    status: str
    reasons: str


def measure(folder: Path, kind: str, rate_hz: float, seconds: float) -> Result:
    """One flood."""
    site, endpoint = load_site(BENCH), processes.free_endpoint()
    args = ["-m", "tests.support.flood", endpoint, str(BENCH), kind, "--rate", str(rate_hz)]
    with (
        processes.router(folder, endpoint),
        Ears(endpoint, site.keys.base) as ears,
        Rig(endpoint, site, AT_CRATE, rate_hz=100.0) as rig,
        processes.guard(folder, BENCH, endpoint),
    ):
        rig.stalled, rig.levers = True, (-0.3, 0.0, 0.0, 0.0)
        ears.wait("alert", lambda b: b["zone"] == "crate", 20.0, 0.0)
        rig.joystick_on = kind not in ("joystick", "both")
        rig.actuators_on = kind not in ("actuators", "both")
        if kind == "none":
            return _figures(ears, kind, seconds, lambda: 0.0)
        args += ["--swing", str(AT_CRATE[0])]
        with Process(folder, "flood", args, talk=True) as flood:
            flood.wait_for("flooding", 20.0)

            def ended() -> float:
                assert flood.popen.stdin is not None
                flood.popen.stdin.close()
                flood.popen.wait(30.0)
                told = json.loads(flood.out.splitlines()[-1])
                return float(told["sent"] / told["seconds"])

            return _figures(ears, kind, seconds, ended)


def _figures(ears: Ears, kind: str, seconds: float, ended: Any) -> Result:
    time.sleep(SETTLE_S)
    start_s = time.monotonic()
    time.sleep(seconds)
    came_hz = ended()
    heard = [h for h in ears.all() if start_s <= h.at_s <= start_s + seconds]
    beats = [h for h in heard if h.topic == "heartbeat"]
    alerts = [h for h in heard if h.topic == "alert" and h.body["stamp"] is not None]
    first, last = beats[0].body, beats[-1].body
    passed_s = last["uptime_s"] - first["uptime_s"]
    late_ms = [_late_ms(h) for h in alerts]
    gaps = np.diff([start_s, *(h.at_s for h in beats), start_s + seconds])
    reasons = sorted({r["code"] for h in beats for r in h.body["reasons"]})
    return Result(
        flood=kind,
        came_hz=came_hz,
        looked_at_hz=(_sum(last["accepted"]) - _sum(first["accepted"])) / passed_s,
        not_looked_at_hz=(_overload(last) - _overload(first)) / passed_s,
        overruns=last["drops"] - first["drops"],
        steps_hz=(last["steps"] - first["steps"]) / passed_s,
        cpu_share=(last["resources"]["cpu_s"] - first["resources"]["cpu_s"]) / passed_s,
        alerts=len(alerts),
        alert_p50_ms=float(np.percentile(late_ms, 50)),
        alert_p99_ms=float(np.percentile(late_ms, 99)),
        beat_gap_max_ms=float(gaps.max() * 1e3),
        status="/".join(sorted({h.body["status"] for h in beats})),
        reasons=", ".join(reasons) or "-",
    )


def _late_ms(heard: Heard) -> float:
    """Arrival less stamp: both on this computer's clocks."""
    now_s = time.monotonic()
    return float((heard.at_s + time.time() - now_s - heard.body["stamp"]) * 1e3)


def _sum(counts: dict[str, int]) -> int:
    return sum(counts.values())


def _overload(beat: dict[str, Any]) -> int:
    return sum(reasons.get("overload", 0) for reasons in beat["rejected"].values())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=10_000.0)
    parser.add_argument("--kind", choices=KINDS, action="append", default=[])
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for kind in args.kind or KINDS:
            result = measure(Path(folder), kind, args.rate, args.seconds)
            if args.json:
                print(json.dumps(asdict(result)), flush=True)
                continue
            print(
                f"{kind:9}  came {result.came_hz:6.0f}/s, looked at {result.looked_at_hz:5.0f}/s,"
                f" not {result.not_looked_at_hz:6.0f}/s (queue full {result.overruns}x);"
                f" {result.steps_hz:4.0f} steps/s, CPU {result.cpu_share:4.0%};"
                f" alerts {result.alerts}, late p50 {result.alert_p50_ms:.1f} p99"
                f" {result.alert_p99_ms:.1f} ms; heartbeats {result.beat_gap_max_ms:.0f} ms apart"
                f" at most; {result.status} ({result.reasons})",
                flush=True,
            )


if __name__ == "__main__":
    main()
