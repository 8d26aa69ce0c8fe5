"""The router is killed, stays away, and comes back on the same port."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.processes import until
from tests.support.station import Station

pytestmark = pytest.mark.e2e

AWAY_S = 3.0
BACK_S = 2.0
"""By the contract, messages flow again so soon after the router is back."""


def test_guard_survives_the_loss_of_its_router(live: Station, tmp_path: Path) -> None:
    live.press_on_crate()
    rig, ears = live.rig, live.ears
    boot_id = ears.all()[-1].body["boot_id"]
    live.router.signal_and_wait(signal.SIGKILL)
    until(lambda: "Zenoh router is gone" in live.guard.err, 2.0, "the loss in the log")
    time.sleep(AWAY_S)
    assert live.guard.alive

    with processes.router(tmp_path, live.endpoint):
        back_s = time.monotonic()
        beat = ears.wait("heartbeat", lambda _: True, 10.0, back_s)
        alert = ears.wait("alert", lambda b: b["zone"] == "crate", 10.0, back_s)
        assert beat.at_s - back_s <= BACK_S
        assert alert.at_s - back_s <= BACK_S
        assert beat.body["boot_id"] == alert.body["boot_id"] == boot_id
        until(lambda: "Zenoh router is back" in live.guard.err, 2.0, "the return in the log")
        ears.wait("heartbeat", lambda b: b["status"] == "ok", 5.0, back_s)
        good = ears.wait(
            "alert", lambda b: b["zone"] == "crate" and b["quality"] == "good", 5.0, back_s
        )
        assert good.body["level"] == "imminent"
        told = [h.body["level"] for h in ears.since(back_s, "alert") if h.body["zone"] == "crate"]
        assert set(told) == {"imminent"}
        alive = f"{live.site.keys.base}/alive"
        assert ears.tokens(alive) == [alive]
        live.calm()
        assert rig.position[0] > 0.9
