"""An object that tells its pose: unknown until it does and when it dies, alarmed when it comes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.contract import Contract
from tests.support.ears import Ears, Heard
from tests.support.processes import BENCH, ROOT, Process
from tests.support.rig import Rig
from tests.support.station import REST

pytestmark = pytest.mark.e2e

KEY = "rampe/bench/cart/pose"
FAR, HERE = "-4,-4,0.1", "0,0,0.1"
"""Out of every reach, and on the swing axis: inside the machine's own foot."""
SPEED = 1.0
CART = f"""\
  - {{name: cart, type: sphere, center: [0, 0, 0], radius_m: 0.1, key: {KEY}, max_speed: 2}}
"""
TIMEOUT_S = 1.0
NOTICE_S = 1.0
"""How long after its time-out a silence may go untold."""


@dataclass
class Scene:
    """A guard of the bench with a cart, the arm at rest."""

    folder: Path
    endpoint: str
    ears: Ears

    def cart(self) -> Process:
        args = ["-m", "tests.support.mover", self.endpoint, KEY, FAR, HERE, str(SPEED)]
        return Process(self.folder, "cart", args)

    def status(self, wanted: str, since_s: float, within_s: float = 10.0) -> Heard:
        return self.ears.wait("heartbeat", lambda b: b["status"] == wanted, within_s, since_s)

    def alert(self, since_s: float, within_s: float, **fields: Any) -> Heard:
        """The first alert of the cart with these values."""
        wanted = {"zone": "cart", **fields}.items()
        return self.ears.wait("alert", lambda b: wanted <= b.items(), within_s, since_s)

    def levels(self, since_s: float) -> set[tuple[str, str]]:
        """Levels and qualities of all alerts of the cart."""
        heard = [h.body for h in self.ears.since(since_s, "alert") if h.body["zone"] == "cart"]
        return {(body["level"], body["quality"]) for body in heard}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    folder = tmp_path_factory.mktemp("moving")
    zones = (ROOT / "config" / "scenes" / "bench.yaml").read_text("utf-8")
    (folder / "scene.yaml").write_text(zones + CART, "utf-8")
    text = BENCH.read_text("utf-8")
    for old, new in (
        ("../../geometry", str(ROOT / "geometry")),
        ("../scenes/bench.yaml", str(folder / "scene.yaml")),
    ):
        assert old in text
        text = text.replace(old, new)
    site_path = folder / "site.yaml"
    site_path.write_text(text, "utf-8")
    site = load_site(site_path)
    endpoint = processes.free_endpoint()
    with contextlib.ExitStack() as stack:
        stack.enter_context(processes.router(folder, endpoint))
        ears = stack.enter_context(Ears(endpoint, site.keys.base))
        stack.enter_context(Rig(endpoint, site, REST))
        guard = stack.enter_context(processes.guard(folder, site_path, endpoint))
        yield Scene(folder, endpoint, ears)
        assert guard.alive, guard.err
        assert "Traceback" not in guard.err, guard.err


def test_it_is_contact_until_it_tells_where_it_is_and_when_it_dies(
    scene: Scene, contract: Contract
) -> None:
    beat = scene.status("degraded", 0.0).body
    (reason,) = [r for r in beat["reasons"] if r["code"] == "object_silent"]
    assert reason["key"] == KEY
    assert "cart" in reason["text"]
    assert [(o["name"], o["placed"], o["age_s"]) for o in beat["objects"]] == [
        ("cart", False, None)
    ]
    scene.alert(0.0, 5.0, level="imminent", quality="degraded")

    start_s = time.monotonic()
    with scene.cart() as cart:
        cart.wait_for("ready")
        scene.alert(start_s, 10.0, level="clear")
        beat = scene.status("ok", time.monotonic()).body
        contract.check(beat)
        (known,) = beat["objects"]
        assert known["placed"]
        assert known["age_s"] < TIMEOUT_S
        assert known["rate_hz"] > 5.0
        quiet_s = time.monotonic()
        time.sleep(2.0)
        assert scene.levels(quiet_s) == set()  # far away it disturbs nobody

        killed_s = time.monotonic()
        cart.popen.kill()
        lost = scene.status("degraded", killed_s)
        assert TIMEOUT_S * 0.5 < lost.at_s - killed_s <= TIMEOUT_S + NOTICE_S
        assert {(r["code"], r["key"]) for r in lost.body["reasons"]} == {("object_silent", KEY)}
        raised = scene.alert(killed_s, 2.0, level="imminent", quality="degraded")
        assert raised.at_s - killed_s <= TIMEOUT_S + NOTICE_S
        time.sleep(2.0)
        assert scene.levels(raised.at_s) == {("imminent", "degraded")}  # and never clear


def test_it_comes_to_an_arm_at_rest_and_is_alarmed_before_it_touches(scene: Scene) -> None:
    start_s = time.monotonic()
    with scene.cart() as cart:
        cart.wait_for("ready")
        scene.status("ok", start_s)
        scene.alert(start_s, 10.0, level="clear")
        go_s = time.monotonic()
        scene.ears.session.put(f"{KEY}/go", b"")
        raised = scene.alert(go_s, 15.0, level="imminent")
        assert (raised.body["source"], raised.body["quality"]) == ("contact", "good")
        assert raised.body["link"] is not None
        # the foot of the arm and the cart are less than 0.3 m wide, the margin is 0.02 m
        way = SPEED * (raised.at_s - go_s)
        assert 4.0 * 2.0**0.5 - 1.5 < way < 4.0 * 2.0**0.5

        time.sleep(1.0)
        killed_s = time.monotonic()
        cart.popen.kill()
        scene.status("degraded", killed_s)
        scene.alert(killed_s, 3.0, level="imminent", quality="degraded")
        time.sleep(1.5)
        assert {level for level, _ in scene.levels(killed_s)} == {"imminent"}
