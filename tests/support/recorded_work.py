"""A stretch of work with all that can happen to a guard in it, for recordings.

``python -m tests.support.recorded_work OUT.mcap`` records it with the real router, guard and
recorder, as `tests/replay/bench.mcap` was made. Its alerts are then as that guard gave them.
"""

from __future__ import annotations

import contextlib
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rampe_guard.settings import Site, load_site
from tests.support import processes
from tests.support.processes import BENCH, ROOT, Process
from tests.support.rig import Rig
from tests.support.station import AT_CRATE, REST, TO_CRATE

CART, ENABLED = "rampe/bench/cart/pose", "rampe/bench/excavator/enabled"
ALIVE = "rampe/bench/excavator/joystick/alive"
_FAR_M, _NEAR_M = 1.2, 0.15
_CART = f"""\
  - {{name: cart, type: sphere, center: [0, 0, 0], radius_m: 0.1, key: {CART}, max_speed: 2}}
"""


def write_site(folder: Path, *, absolute: bool = False) -> Path:
    """The bench with a cart that moves and an enable key; ``absolute`` paths, or all inside."""
    scene = (ROOT / "config" / "scenes" / "bench.yaml").read_text("utf-8") + _CART
    (folder / "scenes").mkdir()
    (folder / "scenes" / "cart.yaml").write_text(scene, "utf-8")
    geometry = str(ROOT / "geometry")
    if not absolute:
        shutil.copytree(ROOT / "geometry" / "bench", folder / "geometry" / "bench")
        geometry = "../geometry"
    text = BENCH.read_text("utf-8")
    for old, new in (
        ("../../geometry", geometry),
        ("../scenes/bench.yaml", "../scenes/cart.yaml"),
        ("  base: rampe/bench", f"  enabled: {ENABLED}\n  base: rampe/bench"),
        ("  actuators: {timeout_s: 1.0}", "  actuators: {timeout_s: 0.6}"),
        ("  joystick: {timeout_s: 1.0}", f"  joystick: {{timeout_s: 1.0, alive_key: {ALIVE}}}"),
    ):
        assert old in text, old
        text = text.replace(old, new)
    (folder / "sites").mkdir()
    path = folder / "sites" / "bench.yaml"
    path.write_text(text, "utf-8")
    return path


class Token:
    """The liveliness token of the joystick: held until `drop`, and again after `hold`."""

    def __init__(self, rig: Rig) -> None:
        self._session = rig._session
        self.hold()

    def hold(self) -> None:
        self._token = self._session.liveliness().declare_token(ALIVE)

    def drop(self) -> None:
        self._token.undeclare()


def work(rig: Rig, token: Token, between: Callable[[], None] = lambda: None) -> None:
    """Ten seconds: levers, a cart, rubbish, silence, the key; ``between`` in the middle."""
    with _cart(rig) as drive:
        time.sleep(0.4)
        _to_the_crate(rig)
        for rubbish in (b"{", b'{"axes": [NaN, 0, 0, 0]}', b'{"axes": [0, 0]}'):
            rig.lever(rubbish)
        rig.lever({"axes": [0.0, 0.0, 0.0, 0.0]}, "rampe/bench/*/joystick")
        time.sleep(0.3)
        drive(_NEAR_M)
        time.sleep(1.2)
        between()
        drive(_FAR_M)
        time.sleep(1.2)
        rig.lever({"enabled": False, "stamp": time.time()}, ENABLED)
        time.sleep(0.5)
        rig.lever({"enabled": True, "stamp": time.time()}, ENABLED)
        time.sleep(0.3)
        rig.actuators_on = False
        time.sleep(0.8)
        rig.actuators_on = True
        time.sleep(1.5)
        token.drop()
        time.sleep(0.4)
        token.hold()
        time.sleep(0.6)
        _to_the_crate(rig)
        time.sleep(0.6)


def _to_the_crate(rig: Rig) -> None:
    """Swing there, press on it, and back to rest."""
    rig.levers = TO_CRATE
    processes.until(lambda: rig.position[0] <= AT_CRATE[0], 10.0, "swing at the crate")
    rig.stalled = True
    time.sleep(0.5)
    rig.stalled = False
    rig.levers = (0.6, 0.0, 0.0, 0.0)
    processes.until(lambda: rig.position[0] >= REST[0], 10.0, "swing at rest")
    rig.levers = (0.0, 0.0, 0.0, 0.0)


@contextlib.contextmanager
def _cart(rig: Rig) -> Iterator[Callable[[float], None]]:
    """A cart that tells its pose 20 times a second; a function says how far off it shall be."""
    goal_m, over = [_FAR_M], threading.Event()

    def tell() -> None:
        at_m = _FAR_M
        while not over.wait(0.05):
            at_m += max(-0.06, min(0.06, goal_m[0] - at_m))
            pose = {"stamp": time.time(), "xyz_m": [-at_m, 0.0, 0.1], "rpy_rad": [0.0, 0.0, 0.0]}
            rig.lever(pose, CART)

    thread = threading.Thread(target=tell, name="cart")
    thread.start()
    try:
        yield lambda metres: goal_m.__setitem__(0, metres)
    finally:
        over.set()
        thread.join()


@contextlib.contextmanager
def recorders(folder: Path, site: Path, endpoint: str, *names: str) -> Iterator[list[Process]]:
    """Recorders into files below ``folder``, all started at once; `machine` waits for them."""
    with contextlib.ExitStack() as stack:
        args = ["-m", "rampe_guard", "record", str(site), "--connect", endpoint]
        yield [
            stack.enter_context(Process(folder, "recorder", [*args, str(folder / name)]))
            for name in names
        ]


@contextlib.contextmanager
def machine(
    folder: Path, site_path: Path, endpoint: str, site: Site, listening: Sequence[Process]
) -> Iterator[tuple[Rig, Token]]:
    """A guard, recorders beside it, and a rig at rest with its joystick's token."""
    with processes.guard(folder, site_path, endpoint):
        for process in listening:
            process.wait_for("recording bench-excavator")
        with Rig(endpoint, site, REST) as rig:
            token = Token(rig)
            time.sleep(0.5)
            yield rig, token


def main(out: str) -> None:
    """Record it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        site_path = write_site(folder)
        endpoint = processes.free_endpoint()
        with (
            processes.router(folder, endpoint),
            recorders(folder, site_path, endpoint, "out.mcap") as (recording,),
        ):
            with machine(folder, site_path, endpoint, load_site(site_path), [recording]) as made:
                work(*made)
            recording.signal_and_wait(signal.SIGTERM)
            sys.stderr.write(f"{recording.err}{recording.out}\n")
        shutil.copy(folder / "out.mcap", out)


if __name__ == "__main__":
    main(sys.argv[1])
