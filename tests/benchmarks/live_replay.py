"""Logs, live: ``python tests/benchmarks/live_replay.py SITE LOG… [--speed 1]``.

For each log a router, a guard and ``replay --live`` run as processes of their own, all logs
side by side. This process only listens. It scores the alerts that came over the wire against
the true motion, and compares their order with that of an offline replay of the same log.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console

from rampe_guard import wire
from rampe_guard.assembly import load_machine
from rampe_guard.core.alarm import Level
from rampe_guard.evaluate.score import total
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.scoring import closing_table
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.zenoh_io import Bus, Inbox
from rampe_guard.settings import Site, load_site


class Ear:
    """One log's processes, and what came over the wire."""

    def __init__(self, site: Site, log: str, speed: float, stack: contextlib.ExitStack) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self.log, self._speed, self._stack = log, speed, stack
        self._site = connect_to(site, [endpoint])
        # nothing is learned beforehand, nor kept of what private recordings teach
        self._state = stack.enter_context(tempfile.TemporaryDirectory())
        self._run("rampe_guard.runtime.router", endpoint)
        machine = load_machine(site)
        self.tally = Tally(machine.sweeper, machine.sweeper.zones)
        bus = Bus.open_retrying(self._site.zenoh, lambda: False, lambda _: None, time.sleep)
        assert bus is not None
        stack.enter_context(bus)
        keys = site.keys
        self._alerts = bus.inbox(f"{keys.base}/alert", 4096)
        self._actuators = bus.inbox(keys.actuators, 4096)
        self.transitions: list[tuple[str, str]] = []
        self.loop_ms: wire.Quantiles | None = None
        self._beats = bus.inbox(f"{keys.base}/heartbeat", 64)
        self._levels: dict[str, str] = {}
        self._newest_s: float | None = None
        self._run("rampe_guard", "run", site.path, "--connect", endpoint)
        self._wait_for_guard()
        self.player = self._run(
            *("rampe_guard", "replay", site.path, log, "--live"),
            *("--speed", str(speed), "--connect", endpoint),
        )

    def poll(self) -> bool:
        """Take what came; whether the log is still playing."""
        for message in self._actuators.drain():
            sample = wire.decode_actuators(message.payload, self._site.actuator_names)
            assert sample.stamp is not None
            self.tally.position(sample.stamp, np.array(sample.position))
            self._newest_s = sample.stamp
        for alert in _messages(self._alerts, wire.Alert):
            if alert.zone is None or alert.stamp is None:
                continue
            late_s = (alert.input_age_s or 0.0) + (alert.compute_ms or 0.0) / 1e3
            at_s = alert.stamp + late_s * self._speed
            self.tally.alert(at_s, alert.zone, Level[alert.level.upper()])
            if self._levels.get(alert.zone, "clear") != alert.level:
                self._levels[alert.zone] = alert.level
                self.transitions.append((alert.zone, alert.level))
        for beat in _messages(self._beats, wire.Heartbeat):
            self.loop_ms = beat.loop_ms or self.loop_ms
            if self._newest_s is not None:  # a heartbeat has no stamp of the log
                monitoring = beat.status != "not_monitoring"
                self.tally.status(self._newest_s, monitoring=monitoring)
        return self.player.poll() is None

    def _wait_for_guard(self) -> None:
        until = time.monotonic() + 60.0
        while not self._beats.drain():
            assert time.monotonic() < until, "the guard gave no heartbeat"
            time.sleep(0.05)

    def _run(self, *arguments: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "STATE_DIRECTORY": self._state},
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.terminate)
        return process


def _messages(inbox: Inbox, kind: type[wire.Alert | wire.Heartbeat]) -> list:  # type: ignore[type-arg]
    return [wire.decode(m.payload, kind) for m in inbox.drain()]


def offline(site_path: str, log: str) -> list[tuple[str, str]]:
    """Transitions of an offline replay."""
    command = [sys.executable, "-m", "rampe_guard", "replay", site_path, log]
    output = subprocess.run(command, check=True, capture_output=True).stdout
    alerts = [json.loads(line) for line in output.splitlines()]
    return [(a["zone"], a["level"]) for a in alerts if a["zone"] is not None]


def main() -> int:
    """Run all logs and print what came of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("site")
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--speed", type=float, default=1.0)
    args = parser.parse_args()
    site, console = load_site(args.site), Console(width=100)
    with contextlib.ExitStack() as stack:
        ears = [Ear(site, log, args.speed, stack) for log in args.logs]
        over_s: float | None = None
        while over_s is None or time.monotonic() < over_s:
            playing = [ear.poll() for ear in ears]
            if not any(playing) and over_s is None:
                over_s = time.monotonic() + 0.5
            time.sleep(0.02)
    scores = []
    for ear in ears:
        console.print(f"[bold]{Path(ear.log).name}[/bold]")
        console.print(closing_table(ear.tally, loop_ms=ear.loop_ms))
        same = ear.transitions == offline(site.path, ear.log)
        console.print(f"same transitions, in the same order, as offline: {same}\n")
        scores += list(ear.tally.scores(Level.WARNING).values())
    everything = total(scores)
    console.print(
        f"all logs: {everything.contacts} contacts, {everything.warned} warned, median lead"
        f" {everything.median_lead_s or 0.0:.2f} s, {everything.alarms} alarms,"
        f" {everything.false_alarms} false"
        f" ({everything.false_per_minute or 0.0:.2f} per minute and zone)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
