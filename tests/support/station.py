"""A router, a guard of the bench site, a scripted machine and ears, ready to test."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rampe_guard.settings import Site, load_site
from tests.support import processes
from tests.support.ears import Ears
from tests.support.processes import BENCH, Process, until
from tests.support.rig import Rig

REST = (1.0, 0.065, 0.08, 0.03)
"""Between the crate (from 0.75 rad down) and the slew limit (1.3 rad), bucket at crate height."""
AT_CRATE = (0.80, 0.065, 0.08, 0.03)
"""Just outside the crate's margin: pushing the lever on is an imminent alert."""
TO_CRATE = (-0.3, 0.0, 0.0, 0.0)
HANDS_OFF = (0.0, 0.0, 0.0, 0.0)
TIMEOUT_S = 1.0
"""Of both inputs in the bench site."""


@dataclass
class Station:
    """What an end-to-end test works with."""

    site: Site
    site_path: Path
    endpoint: str
    router: Process
    guard: Process
    rig: Rig
    ears: Ears

    def calm(self, within_s: float = 15.0) -> None:
        """Both streams on, levers let go, arm at rest: wait until that is what is heard."""
        rig = self.rig
        rig.levers, rig.stalled = HANDS_OFF, False
        rig.joystick_on = rig.actuators_on = True
        if rig.position != REST:
            self.drive_to(REST[0])
        start_s = time.monotonic()
        self.ears.wait("heartbeat", lambda b: b["status"] != "not_monitoring", within_s, start_s)
        until(self._quiet, within_s, "no zone raised and no primitive under way")

    def drive_to(self, swing: float, lever: float = 0.5) -> None:
        """Swing there with the lever pushed, and let go."""
        rig = self.rig
        up = swing > rig.position[0]
        rig.levers = (lever if up else -lever, 0.0, 0.0, 0.0)
        until(lambda: (rig.position[0] >= swing) is up, 20.0, f"swing at {swing}")
        rig.levers = HANDS_OFF

    def press_on_crate(self) -> None:
        """Swing to the crate, stall there with the lever pushed: imminent for as long as it is."""
        start_s = time.monotonic()
        self.drive_to(AT_CRATE[0], 0.3)
        self.rig.stalled = True
        self.rig.levers = TO_CRATE
        self.ears.wait(
            "alert", lambda b: b["zone"] == "crate" and b["level"] == "imminent", 5.0, start_s
        )

    def _quiet(self) -> bool:
        """By the guard's own account."""
        states = self.ears.ask(f"{self.site.keys.base}/state")
        assert len(states) == 1
        raised = [a["zone"] for a in states[0]["alerts"] if a["zone"] and a["level"] != "clear"]
        return not raised and all(p["event"] == "ended" for p in states[0]["predictions"])


@contextlib.contextmanager
def station(folder: Path, site_path: Path = BENCH, *more: str) -> Iterator[Station]:
    """Start all, machine at rest and both streams on; end all. ``more`` are options of ``run``."""
    site = load_site(site_path)
    endpoint = processes.free_endpoint()
    with contextlib.ExitStack() as stack:
        router = stack.enter_context(processes.router(folder, endpoint))
        ears = stack.enter_context(Ears(endpoint, site.keys.base))
        rig = stack.enter_context(Rig(endpoint, site, REST))
        guard = stack.enter_context(processes.guard(folder, site_path, endpoint, *more))
        made = Station(site, site_path, endpoint, router, guard, rig, ears)
        ears.wait("heartbeat", lambda b: b["status"] == "ok", 20.0, 0.0)
        yield made
        assert made.guard.alive, made.guard.err  # a test may have started another
        assert "Traceback" not in made.guard.err, made.guard.err
