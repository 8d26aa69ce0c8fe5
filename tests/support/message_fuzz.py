"""Spoilt messages through the daemon's own loop, and what must hold of all of them.

Joystick and actuators are JSON, or CDR as ROS 2 sends it.

`runtime.daemon.run` itself runs, on a bus within this process and on a clock that advances by ten
milliseconds a turn. At each turn a scripted machine tells truly how it stands, and between its
messages come spoilt ones, of every kind that a guard takes. It must hold that

* nothing is raised, and every query is answered or refused;
* no turn takes a second of processor time;
* what is published can be read, and what is accepted conforms to the contract's JSON Schema;
* while the arm pushes against the crate, it is shown as imminent, or that nobody watches.

The last is judged in *strict* stretches, in which no message is fed that is well-formed and says
something else of the machine: such a one is a lie, not a fault, and no guard can know it.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import random
import re
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Self, TypeVar
from unittest import mock

import jsonschema  # type: ignore[import-untyped]

from rampe_guard import wire
from rampe_guard.errors import MessageError
from rampe_guard.runtime import daemon, intake, worker
from rampe_guard.runtime.decoding import decoders_of, limits_said
from rampe_guard.settings import Site, load_site
from tests.support import ros2
from tests.support.bench_site import bench_copy
from tests.support.gauges import cost
from tests.support.memory_bus import MemoryBus, Query
from tests.support.mutator import Mutator
from tests.support.processes import ROOT
from tests.support.pusher import Driver

T = TypeVar("T")

TURN_S = 0.01
STRETCH = 1000
"""Turns between two choices of what is fed."""
SETTLE = 300
"""Turns of sound messages alone before a strict stretch is judged: silences are over by then."""
REACH = 120
"""Turns in which the arm gets to the crate."""
SLOWEST_S = 1.0
SCENE = ROOT / "config" / "scenes" / "bench.yaml"
_EACH = (1, 8, 32, 32, 32, 32)
"""Spoilt messages a turn: few, so that something is learned; many, but no more than are read."""
_SCENE_SHARE = 1 / 2000
_KEPT = 60


@dataclass
class Found:
    """What came of it.

    Attributes:
        fed: spoilt messages, by kind.
        well_formed: of them, those that a decoder took.
        left_out: well-formed lies that were not fed in strict stretches.
        judged: turns of strict stretches in which the arm pushed.
        lost: of these, turns in which it was shown that nobody watches.
        slowest_s: longest turn, of processor time [s].
        wrong: what did not hold.
        memory_mb: memory after a fifth, and in the end [MB].
        refused: by input, then reason, as the heartbeat counts.
        scenes: that were put and taken.
    """

    fed: Counter[str] = field(default_factory=Counter)
    well_formed: Counter[str] = field(default_factory=Counter)
    left_out: int = 0
    judged: int = 0
    lost: int = 0
    slowest_s: float = 0.0
    wrong: list[str] = field(default_factory=list)
    memory_mb: list[float] = field(default_factory=list)
    refused: dict[str, dict[str, int]] = field(default_factory=dict)
    scenes: int = 0

    @property
    def messages(self) -> int:
        """Spoilt ones."""
        return self.fed.total()


class Screen:
    """What a consumer shows, on the clock of the turns."""

    def __init__(self) -> None:
        self.alerts: dict[str | None, dict[str, Any]] = {}
        self.beat: dict[str, Any] = {}

    def take(self, key: str, payload: bytes) -> None:
        """A message of the guard."""
        body = json.loads(payload, parse_constant=_no_constant)
        if key.endswith("/heartbeat"):
            self.beat = body
        elif key.endswith("/alert"):
            if body["state"] == "normal":
                self.alerts.pop(body["zone"], None)
            else:
                self.alerts[body["zone"]] = body

    def shown(self, zone: str) -> str:
        """A level, or lost."""
        if self.beat.get("status") not in ("ok", "degraded"):
            return "lost"
        found = self.alerts.get(zone)
        return "clear" if found is None else str(found["level"])


class Contract:
    """The JSON Schemas of what a guard takes."""

    def __init__(self) -> None:
        self._validators: dict[str, Any] = {}
        for kind in ("joystick", "actuators", "enabled", "object_pose"):
            path = ROOT / "config" / "contract" / f"rampe.{kind}.v1.schema.json"
            self._validators[kind] = jsonschema.Draft202012Validator(json.loads(path.read_text()))

    def fault(self, kind: str, payload: bytes) -> str | None:
        """Why a payload that was taken should not have been; None if it is fit."""
        try:
            body = json.loads(payload, parse_constant=_no_constant)
        except (ValueError, RecursionError) as error:
            return f"no JSON: {error}"
        broken = [str(e.message)[:200] for e in self._validators[kind].iter_errors(body)]
        return broken[0] if broken else None


def _no_constant(word: str) -> float:
    raise ValueError(f"{word} is not JSON")


class Fuzz:
    """Stands where a daemon's stop flag stands: its ``wait`` is called at every turn.

    Args:
        site: that is guarded.
        messages: spoilt messages to feed.
        seed: of all choices.
        told: called now and then with what was found so far.
    """

    def __init__(self, site: Site, messages: int, seed: int, told: Callable[[Found], None]) -> None:
        self._site, self._wanted, self._told = site, messages, told
        self._rng = random.Random(seed)
        self._driver = Driver([a.max_velocity for a in site.guard.actuators], seed)
        self._screen, self._contract = Screen(), Contract()
        self.bus = MemoryBus(self._screen.take)
        self.found = Found()
        self.now_s, self._unix_s = time.monotonic(), 1.8e9
        self._turns = self._settled = 0
        self._strict, self._each = False, 0
        self._began_s: float | None = None
        self._asked: deque[tuple[int, str, Query]] = deque()
        self._scene: Query | None = None
        self._recent: deque[tuple[str, bytes]] = deque(maxlen=_KEPT)
        keys = site.keys
        truck = site.scene.moving[0].key
        assert keys.enabled is not None
        assert truck is not None
        self._inputs = {
            "joystick": keys.joystick,
            "actuators": keys.actuators,
            "enabled": keys.enabled,
            "object_pose": truck,
        }
        self._words = ("ack", "shelve", "forget", "state", "scene", "scene/put")
        corpus = [*self._sound().values(), *(self._wish(word) for word in self._words[:3])]
        self._decoders = decoders_of(site, limits_said(site))
        self._mutator = Mutator(self._rng, corpus)

    # What a stop flag is.

    def __call__(self) -> bool:
        return self.found.messages >= self._wanted

    def unless_stopped(self, work: Callable[[], T]) -> T | None:
        """Do it."""
        return work()

    def wait(self, _: float) -> bool:
        """Judge the turn that ends, and feed the next one."""
        ended_s = time.thread_time()
        if self._began_s is not None:
            self.found.slowest_s = max(self.found.slowest_s, ended_s - self._began_s)
            if ended_s - self._began_s > SLOWEST_S:
                self._complain(f"a turn took {ended_s - self._began_s:.2f} s")
        self._judge()
        self._turns += 1
        self.now_s += TURN_S
        if self._turns % STRETCH == 1:
            self._choose()
        self._feed()
        self._began_s = time.thread_time()
        return self()

    # What is fed.

    def _choose(self) -> None:
        """What the next stretch is like."""
        rng, found = self._rng, self.found
        before, self._strict = self._strict, self._turns == 1 or rng.random() < 0.75
        self._each = rng.choice(_EACH)
        self._driver.task = "hold" if self._strict else "work"
        if not before:
            self._settled = self._turns + (SETTLE if self._turns > 1 else REACH)
        found.refused = self._screen.beat.get("rejected", {})
        if (not found.memory_mb and found.messages > self._wanted / 5) or self():
            found.memory_mb.append(cost(os.getpid()).own_mb)
        self._told(found)

    def _feed(self) -> None:
        moment = self._driver.step(TURN_S)
        self._levers = list(moment.levers)
        sound = self._sound()
        spoilt = 0 if self._turns < self._settled and self._strict else self._each
        first = self._rng.randint(0, spoilt)
        for number in range(spoilt + 1):
            if number == first:
                for kind, payload in sound.items():
                    if kind != "object_pose" or self._rng.random() < 0.2:
                        self.bus.put(self._inputs[kind], payload)
            if number < spoilt:
                self._spoil(sound)

    def _sound(self) -> dict[str, bytes]:
        """What is so."""
        stamp = {"stamp": round(self._unix_s + self.now_s, 6)}
        told: dict[str, dict[str, Any]] = {
            "joystick": {**stamp, "axes": getattr(self, "_levers", [0.0] * 4)},
            "actuators": {**stamp, "position": list(self._driver.position)},
            "enabled": {**stamp, "enabled": True},
            "object_pose": {**stamp, "xyz_m": [5.0, 0.0, 0.0], "rpy_rad": [0.0, 0.0, 0.0]},
        }
        said = {kind: json.dumps(body).encode() for kind, body in told.items()}
        if self._site.ros2 is not None:
            at_s, levers = told["joystick"]["stamp"], told["joystick"]["axes"]
            said["joystick"] = ros2.joy(levers, at_s)
            angles = ros2.angles_of(self._site, self._driver.position)
            said["actuators"] = ros2.joint_state(angles, at_s)
        return said

    def _spoil(self, sound: dict[str, bytes]) -> None:
        rng = self._rng
        if rng.random() < _SCENE_SHARE:
            self._put_scene()
            return
        if rng.random() < 0.2:
            word = rng.choice(self._words[:5])
            self._ask(word, self._mutator.spoil(self._wish(word)))
            return
        kind = rng.choice(("joystick", "joystick", "actuators", "actuators", "enabled",
                           "object_pose"))  # fmt: skip
        payload = self._mutator.spoil(sound[kind])
        well_formed = self._decodes(kind, payload)
        if well_formed and self._strict and kind != "object_pose":
            self.found.left_out += 1
            return
        key = self._inputs[kind]
        put_on = rng.choice(("rampe/**", f"{key[:-1]}*", "**")) if rng.random() < 0.02 else key
        self.found.fed[kind] += 1
        self.found.well_formed[kind] += well_formed
        self._recent.append((put_on, payload))
        self.bus.put(put_on, payload, key)

    def _decodes(self, kind: str, payload: bytes) -> bool:
        """Whether the guard's decoder takes it; if so, the contract must as well."""
        try:
            if kind == "joystick":
                self._decoders.joystick(payload)
            elif kind == "actuators":
                self._decoders.actuators(payload)
            elif kind == "enabled":
                wire.decode_enabled(payload)
            else:
                wire.decode_object_pose(payload)
        except MessageError:
            return False
        if self._site.ros2 is not None and kind in ("joystick", "actuators"):
            return True
        fault = self._contract.fault(kind, payload)
        if fault is not None and "maximum" not in fault and "minimum" not in fault:
            self._complain(f"{kind} was taken against the contract ({fault}): {payload[:300]!r}")
        return True

    def _wish(self, word: str) -> bytes:
        ids = [alert["alert_id"] for alert in self._screen.alerts.values()]
        alert = self._rng.choice(ids) if ids else "nobody"
        wish: dict[str, dict[str, Any]] = {
            "ack": {"alert_id": alert, "who": "fuzz"},
            "shelve": {"alert_id": alert, "who": "fuzz", "duration_s": 5.0},
            "forget": {"operator": self._site.operator, "who": "fuzz"},
        }
        return json.dumps(wish.get(word, {})).encode()

    def _ask(self, word: str, payload: bytes) -> Query:
        desk = self.bus.desks[f"{self._site.keys.base}/{word}"]
        self.found.fed[word] += 1
        self._recent.append((word, payload))
        pattern = f"{self._site.keys.base}/*" if self._rng.random() < 0.05 else None
        query = desk.ask(payload or None, pattern)
        self._asked.append((self._turns, word, query))
        return query

    def _put_scene(self) -> None:
        """A spoilt scene; one that is taken is followed by the right one."""
        if self._scene is not None:
            return
        text = json.dumps({"scene": SCENE.read_text("utf-8") + _TRUCK, "who": "fuzz"}).encode()
        if self._rng.random() < 0.3:
            spoilt = self._mutator.spoil(text)
        else:
            scene = json.loads(text)["scene"].encode()
            for _ in range(self._rng.randint(0, 3)):
                scene = self._mutator.spoil(scene)
            body = {"scene": scene.decode("utf-8", "replace"), "who": "fuzz"}
            spoilt = json.dumps(body).encode()
        self._scene = self._ask("scene/put", spoilt)

    def _follow_scene(self) -> None:
        """Once an answer has come: the scene that holds is the right one again."""
        query = self._scene
        if query is None or not query.dropped:
            return
        self._scene = None
        if not query.answers:
            return
        self.found.scenes += 1
        text = SCENE.read_text("utf-8") + _TRUCK
        if json.loads(query.answers[0])["zones"] and text != getattr(query, "text", None):
            wish = json.dumps({"scene": text, "who": "fuzz"}).encode()
            desk = self.bus.desks[f"{self._site.keys.base}/scene/put"]
            self._scene = desk.ask(wish)
            self._scene.text = text  # type: ignore[attr-defined]
        self._settled = max(self._settled, self._turns + SETTLE)

    # What must hold.

    def _judge(self) -> None:
        while self._asked and self._turns - self._asked[0][0] > SETTLE:
            _, word, query = self._asked.popleft()
            if not query.dropped and word != "scene/put":
                self._complain(f"a query on {word} was left without an answer")
        self._follow_scene()
        if not self._strict or self._turns < self._settled or self._scene is not None:
            return
        shown = self._screen.shown("crate")
        self.found.judged += 1
        self.found.lost += shown == "lost"
        if shown not in ("imminent", "lost"):
            self._complain(f"shown {shown} while the arm pushes, status {self._screen.beat}")

    def _complain(self, what: str) -> None:
        if len(self.found.wrong) < 20:
            recent = [(key, payload[:200]) for key, payload in list(self._recent)[-12:]]
            self.found.wrong.append(f"turn {self._turns}: {what[:1500]}; fed last: {recent}")

    # The clock.

    def clock(self) -> Any:
        """In the place of the module `time`."""
        return SimpleNamespace(
            monotonic=lambda: self.now_s,
            time=lambda: self._unix_s + self.now_s,
            perf_counter=time.perf_counter,
            sleep=time.sleep,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to close."""


_TRUCK = """
  - {name: truck, type: sphere, radius_m: 0.5, center: [0, 0, 0], key: rampe/bench/fuzz/truck,
     max_speed: 1.0, timeout_s: 5.0}
"""


def fuzz_site(folder: Path, *, cdr: bool = False) -> Path:
    """The bench site with an enable key and an object that moves; in ROS 2's words if ``cdr``."""
    scene = folder / "scene.yaml"
    scene.write_text(SCENE.read_text("utf-8") + _TRUCK, "utf-8")
    path = bench_copy(folder, "next: {situations: 10000}", machine="fuzz", scene=scene)
    text = path.read_text("utf-8").replace("keys:\n", "keys:\n  enabled: rampe/bench/fuzz/on\n")
    if cdr:
        text = re.sub(r"joystick: rampe/\S+", "joystick: /joy", text)
        text = re.sub(r"actuators: rampe/\S+", "actuators: /joint_states", text)
        text += "\nformat: ros2\nros2: {publish: false}\n"
    path.write_text(text, "utf-8")
    return path


def fuzz_messages(
    folder: Path,
    messages: int,
    seed: int,
    told: Callable[[Found], None] = lambda _: None,
    *,
    cdr: bool = False,
) -> Found:
    """Feed so many; what came of it. Raises whatever the daemon raises."""
    path = fuzz_site(folder, cdr=cdr)
    fuzz = Fuzz(load_site(path), messages, seed, told)
    with _patched(fuzz, folder):
        daemon.run(str(path), (), fuzz)  # type: ignore[arg-type]
    fuzz.found.memory_mb.append(cost(os.getpid()).own_mb)
    return fuzz.found


def main() -> None:
    """A process of `tests.benchmarks.fuzz`: FOLDER MESSAGES SEED CDR; what was found, as JSON."""
    logging.getLogger("rampe_guard").addHandler(logging.NullHandler())

    def told(found: Found) -> None:
        print(json.dumps({**vars(found), "messages": found.messages}), flush=True)

    folder, messages, seed, cdr = sys.argv[1:]
    told(fuzz_messages(Path(folder), int(messages), int(seed), told, cdr=cdr == "cdr"))


@contextlib.contextmanager
def _patched(fuzz: Fuzz, folder: Path) -> Iterator[None]:
    clock = fuzz.clock()
    with (
        mock.patch.object(daemon, "Bus", fuzz.bus),
        mock.patch.object(worker, "time", clock),
        mock.patch.object(intake, "time", clock),
        mock.patch.dict(os.environ, {"STATE_DIRECTORY": str(folder / "state")}),
    ):
        yield


if __name__ == "__main__":
    main()
