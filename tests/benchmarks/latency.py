"""How long from a position being put to the alert that it causes? Real processes on loopback.

``python tests/benchmarks/latency.py [--motion work|edge] [--rate 100] [--seconds 20] [--json]``

A router, a guard of the demo site (20-tonne excavator in the quarry) and this process, which
sends levers and positions. ``work`` is the simulated operator, who goes too far in every
cycle. ``edge`` is the hardest case: an arm that swings to and fro at the edge of three zones,
so that alerts are active or change all the time. An alert carries the stamp of the newest position
that it was computed from: latency is its arrival here less the time of that put, so it
includes both hops over the router, waiting, the sweeps and the JSON.

Nothing queues if latency stays the same from the first quarter of the run to the last, no
message is lost, and the newest sample is never old when a step takes it up: its age is the
time from its put to the start of the step that used it.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rampe_guard.assembly import load_machine
from rampe_guard.settings import Site, load_site
from rampe_guard.simulate.machine import build_machine
from rampe_guard.simulate.quarry import START, quarry_operator
from rampe_guard.simulate.run import simulate
from tests.support import processes
from tests.support.ears import Ears, Heard, open_session

TARGET_P99_MS = 25.0
WORK_HZ = 200.0
# actuator: middle, swing to each side [unit], period [s]; speeds stay below the machine's
MOTION = ((-0.50, 0.50, 4.2), (1.02, 0.14, 4.3), (0.25, 0.12, 3.1), (0.35, 0.12, 2.7))


@dataclass(frozen=True)
class Result:
    """Figures of one run; ages in periods of the input."""

    rate_hz: float
    seconds: float
    sent: int
    accepted: int
    refused: dict[str, int]
    drops: int
    alerts: int
    zones: dict[str, int]
    sender_late_p99_ms: float
    latency_ms: dict[str, float]
    compute_ms: dict[str, float]
    latency_first_quarter_p50_ms: float
    latency_last_quarter_p50_ms: float
    age_p50_periods: float
    age_p99_periods: float
    loop_ms: dict[str, float]
    sweep_ms: dict[str, float]
    guard_cpu_share: float


class Arm:
    """Every actuator on a sine; the levers show its speed as a share of the top speed."""

    def __init__(self, site: Site) -> None:
        self._top = [a.max_velocity for a in site.guard.actuators]

    def at(self, t: float) -> tuple[list[float], list[float], list[float]]:
        """Axes, position and velocity at ``t`` [s]."""
        position, velocity = [], []
        for middle, amplitude, period in MOTION:
            w = 2.0 * math.pi / period
            position.append(middle + amplitude * math.sin(w * t))
            velocity.append(amplitude * w * math.cos(w * t))
        axes = [max(-1.0, min(1.0, v / top)) for v, top in zip(velocity, self._top, strict=True)]
        return axes, position, velocity


class Work:
    """The simulated operator at work on the demo machine."""

    def __init__(self, site: Site, seconds: float) -> None:
        operator = quarry_operator(site.guard.actuators, seed=1, overshoot_probability=1.0)
        limits = load_machine(site).arm.limits
        machine = build_machine(site.guard.actuators, limits)
        self._ticks = list(
            simulate(
                *(site.guard.actuators, operator, machine, START),
                rate_hz=WORK_HZ,
                duration_s=seconds + 1.0,
            )
        )

    def at(self, t: float) -> tuple[list[float], list[float], list[float]]:
        """Axes, position and velocity at ``t`` [s]."""
        tick = self._ticks[min(int(t * WORK_HZ), len(self._ticks) - 1)]
        return tick.axes.tolist(), tick.position.tolist(), tick.velocity.tolist()


def send(
    endpoint: str, site: Site, arm: Arm | Work, rate_hz: float, seconds: float
) -> tuple[dict[float, float], list[float]]:
    """Send both inputs; returns the monotonic time of each position's put by its stamp.

    And by how much each was late [ms]: how busy the machine is with other things.
    """
    put_s: dict[float, float] = {}
    late_ms: list[float] = []
    session = open_session(endpoint)
    try:
        levers = session.declare_publisher(site.keys.joystick, express=True)
        positions = session.declare_publisher(site.keys.actuators, express=True)
        processes.until(lambda: bool(positions.matching_status), 5.0, "the guard listens")
        start_s = time.monotonic()
        for k in range(round(rate_hz * seconds)):
            wait_s = start_s + k / rate_hz - time.monotonic()
            if wait_s > 0.0:
                time.sleep(wait_s)
            late_ms.append((time.monotonic() - start_s - k / rate_hz) * 1e3)
            axes, position, velocity = arm.at(time.monotonic() - start_s)
            stamp = time.time()
            lever = {"stamp": stamp, "axes": axes}
            message = {"stamp": stamp, "position": position, "velocity": velocity}
            levers.put(json.dumps(lever).encode())
            payload = json.dumps(message).encode()
            put_s[stamp] = time.monotonic()
            positions.put(payload)
    finally:
        session.close()
    return put_s, late_ms


def cpu_s(pid: int) -> float:
    """Processor time a process has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def latencies_ms(heard: list[Heard], put_s: dict[float, float]) -> np.ndarray:
    """Arrival less put, of each message whose stamp is a position of this run."""
    pairs = [(h.at_s, put_s[h.body["stamp"]]) for h in heard if h.body["stamp"] in put_s]
    return np.array([(at_s - sent_s) * 1e3 for at_s, sent_s in pairs])


def _summary(values: np.ndarray) -> dict[str, float]:
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": float(p50), "p99": float(p99), "max": float(values.max())}


def measure(motion: str, rate_hz: float, seconds: float) -> Result:
    """Start all, warm up for a second, measure, end all."""
    endpoint, site = processes.free_endpoint(), load_site(processes.DEMO)
    arm = Arm(site) if motion == "edge" else Work(site, seconds)
    with (
        tempfile.TemporaryDirectory() as folder,
        processes.router(Path(folder), endpoint),
        Ears(endpoint, site.keys.base) as ears,
        processes.guard(Path(folder), processes.DEMO, endpoint) as guard,
    ):
        send(endpoint, site, arm, rate_hz, 1.0)
        time.sleep(site.guard.inputs.actuators_timeout_s + 0.5)  # a new start of the sine
        before = ears.wait("heartbeat", lambda _: True, 5.0, time.monotonic()).body
        worker = processes.guarding(guard)
        used_s, began_s = cpu_s(worker), time.monotonic()
        put_s, late_ms = send(endpoint, site, arm, rate_hz, seconds)
        share = (cpu_s(worker) - used_s) / (time.monotonic() - began_s)
        time.sleep(0.5)
        last = ears.wait("heartbeat", lambda _: True, 5.0, time.monotonic()).body
        alerts = ears.since(began_s, "alert")
    # after the last position alerts repeat until the time-out: that is no latency
    end_stamp = max(put_s)
    alerts = [a for a in alerts if a.body["zone"] and a.body["stamp"] != end_stamp]
    taken = latencies_ms(alerts, put_s)
    if not len(taken):
        raise SystemExit("no alert came: nothing was measured")
    quarter = max(len(taken) // 4, 1)
    latency = _summary(taken)
    # published_unix_s is the time at which the step began
    ages = [a.body["published_unix_s"] - a.body["stamp"] for a in alerts]
    zones = [a.body["zone"] for a in alerts]
    accepted = last["accepted"]["actuators"] - before["accepted"]["actuators"]
    return Result(
        rate_hz=rate_hz,
        seconds=seconds,
        sent=len(put_s),
        accepted=accepted,
        refused=last["rejected"].get("actuators", {}),
        drops=last["drops"] - before["drops"],
        alerts=len(taken),
        zones={zone: zones.count(zone) for zone in sorted(set(zones))},
        sender_late_p99_ms=float(np.percentile(late_ms, 99)),
        latency_ms=latency,
        compute_ms=_summary(np.array([a.body["compute_ms"] for a in alerts])),
        latency_first_quarter_p50_ms=float(np.median(taken[:quarter])),
        latency_last_quarter_p50_ms=float(np.median(taken[-quarter:])),
        age_p50_periods=float(np.percentile(ages, 50)) * rate_hz,
        age_p99_periods=float(np.percentile(ages, 99)) * rate_hz,
        loop_ms=last["loop_ms"],
        sweep_ms=last["sweep_ms"],
        guard_cpu_share=share,
    )


def table(r: Result) -> str:
    """The same for people."""
    zones = ", ".join(f"{zone} {count}" for zone, count in r.zones.items())
    verdict = "within" if r.latency_ms["p99"] <= TARGET_P99_MS else "OVER"
    rows = (
        ("input", f"{r.rate_hz:g} Hz for {r.seconds:g} s: {r.sent} sent, {r.accepted} taken"),
        ("", f"refused {r.refused or 'none'}, {r.drops} overruns"),
        ("sender late by", f"p99 {r.sender_late_p99_ms:.1f} ms"),
        ("alerts", f"{r.alerts} ({zones})"),
        ("put to alert", f"{_quantiles(r.latency_ms)}: {verdict} {TARGET_P99_MS:g} ms"),
        ("  of it computing", _quantiles(r.compute_ms)),
        ("  first quarter", f"p50 {r.latency_first_quarter_p50_ms:.1f} ms"),
        ("  last quarter", f"p50 {r.latency_last_quarter_p50_ms:.1f} ms"),
        ("age when used", f"p50 {r.age_p50_periods:.1f}, p99 {r.age_p99_periods:.1f} periods"),
        ("loop", _quantiles(r.loop_ms)),
        ("sweep", _quantiles(r.sweep_ms)),
        ("guard's CPU", f"{r.guard_cpu_share:.0%} of a core"),
    )
    return "\n".join(f"{name:18} {text}" for name, text in rows)


def _quantiles(of: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.1f}" for name, value in of.items()) + " ms"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("--motion", choices=("work", "edge"), default="work")
    parser.add_argument("--rate", type=float, default=100.0, help="of both inputs [Hz]")
    parser.add_argument("--seconds", type=float, default=20.0, help="length of the run [s]")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object")
    args = parser.parse_args()
    result = measure(args.motion, args.rate, args.seconds)
    print(json.dumps(asdict(result)) if args.json else table(result))


if __name__ == "__main__":
    main()
