"""Faults of the guard's own computer: its disk, its clock; and scenes that change all the time."""

from __future__ import annotations

import contextlib
import json
import random
import resource
import time
from collections.abc import Iterator

from rampe_guard.collision import load_arm
from rampe_guard.recording import open_log
from tests.support.faults import Fault
from tests.support.ground import Ground
from tests.support.processes import ROOT, Process

_SCENE = (ROOT / "config" / "scenes" / "bench.yaml").read_text("utf-8")
_OTHER = """
  - {name: visitor, type: sphere, radius_m: 0.1, center: [2.0, %.3f, 0.0]}
"""


@contextlib.contextmanager
def full_disk(pid: int) -> Iterator[None]:
    """No file of a process grows any more; not even its log."""
    before = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        yield
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, before)


def disk_full(ground: Ground, _: random.Random, seconds: float) -> float:
    """The guard cannot write what it learns, its marks, or its log; it must say so."""

    def told() -> bool:
        reasons = ground.witness.beats.newest["reasons"]
        return any(reason["code"] == "model_not_kept" for reason in reasons)

    with full_disk(ground.worker):
        ground.pause(seconds / 2)
        ground.tell(task="work")  # there is something to learn, and to save
        ground.wait(told, 60.0, "model_not_kept")
        ground.pause(seconds / 2)
    return time.monotonic()


def recorder_disk_full(ground: Ground, _: random.Random, seconds: float) -> float:
    """The recorder cannot write; when it can again, it goes on, and all its files are whole."""
    folder = ground.folder / f"recordings-{time.monotonic_ns()}"
    folder.mkdir()
    words = ["-m", "rampe_guard", "record", str(ground.site_path), str(folder / "day.mcap")]
    with Process(ground.folder, "recorder", [*words, "--connect", ground.endpoint]) as recorder:
        ground.wait(
            lambda: any(f.stat().st_size for f in folder.glob("*.mcap")), 60.0, "a recording"
        )
        ground.pause(3.0)  # some of it is on the disk
        with full_disk(recorder.pid):
            ground.pause(seconds)
        ground.wait(lambda: len(list(folder.glob("*.mcap"))) > 1, 30.0, "another file")
        ground.pause(2.0)
        assert recorder.alive, recorder.err
    limits = load_arm(ground.site.arm).limits
    files = sorted(folder.glob("*.mcap"))
    for file in files:
        open_log(ground.site, str(file), limits)
    return time.monotonic()  # the guard was judged all the while


def clock_set_back(ground: Ground, rng: random.Random, seconds: float) -> float:
    """The wall clock of the guard's computer is an hour off, and right again."""
    assert ground.clock is not None, "start the ground with a clock"
    offset_s = rng.choice((-3600.0, 3600.0))
    ground.clock.write_text(str(offset_s), "utf-8")
    ground.pause(seconds)

    def told() -> bool:
        told_s = ground.witness.beats.newest["published_unix_s"]
        return bool(abs(told_s - time.time() - offset_s) < 60.0)

    ground.wait(told, 10.0, "a heartbeat by the changed clock")
    ground.clock.write_text("0", "utf-8")
    return time.monotonic()


def scenes_put(times: int) -> Fault:
    """So many scenes, one after the other, each with the crate in it."""

    def act(ground: Ground, _: random.Random, _seconds: float) -> float:
        hashes = set()
        for number in range(times):
            scene = _SCENE + (_OTHER % (number / 1000.0) if number % 2 else "")
            wish = json.dumps({"scene": scene, "who": "tester"}).encode()
            answers = ground.ask("scene/put", wish)
            assert len(answers) == 1, f"scene {number}: no answer"
            hashes.add(answers[0]["scene_hash"])
        assert len(hashes) > times // 2
        return time.monotonic()

    return Fault(
        f"{times} scenes put while it sweeps", "guards on", act, 0.0, back_s=1.0, blinds=False
    )


INSIDE = (
    Fault(
        "disk full under the guard",
        "guards on; degraded: model_not_kept",
        disk_full,
        seconds=8.0,
        back_s=1.0,
        blinds=False,
    ),
    Fault(
        "disk full under the recorder",
        "the guard does not notice; the recorder goes on in a new file, all of them whole",
        recorder_disk_full,
        seconds=5.0,
        back_s=1.0,
        blinds=False,
    ),
    Fault(
        "wall clock set by an hour",
        "guards on",
        clock_set_back,
        seconds=3.0,
        back_s=1.0,
        blinds=False,
    ),
)
