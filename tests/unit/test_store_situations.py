"""The memory of situations on the disk: it survives, beside the model, whatever happens."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.situation import Likeness
from rampe_guard.core.situation_memory import CHUNK, SituationMemory
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_path, situations_file
from rampe_guard.runtime.store_format import decode, situations_header
from rampe_guard.runtime.store_situations import (
    SAVE_S,
    SituationKeeper,
    decode_situations,
    encode_situations,
    recall_situations,
)
from rampe_guard.settings import Site
from tests.support.models import bench_limits, bench_site, same_bits
from tests.support.processes import ROOT, until

N = 4
TOP = np.array([0.6, 0.05, 0.05, 0.05])


def memory(capacity: int = 20_000) -> SituationMemory:
    return SituationMemory(Likeness(TOP), N, 2.5, capacity)


def work(mind: SituationMemory, situations: int, begin_s: float = 0.0) -> SituationMemory:
    """So many situations more, ten a second, all different."""
    rng = np.random.default_rng(int(begin_s))
    steps = rng.uniform(0.015, 0.03, (situations, N)) * rng.choice([-1.0, 1.0], (situations, N))
    places = np.cumsum(steps, axis=0)
    for k, place in enumerate(places):
        mind.see(begin_s + 0.1 * (k + 1), place, np.append(np.tile(place, 3), 0.0))
    return mind


class Desk:
    """A keeper with a memory; time is passed in."""

    def __init__(self, site: Site, mind: SituationMemory | None = None) -> None:
        self.mind = memory() if mind is None else mind
        self.file = situations_file(model_path(site))
        self.path = self.file.path
        self.keeper = SituationKeeper(site, bench_limits(site), Sayer("rampe_guard.test"))
        self.keeper.begin(model_path(site), self.mind, 0.0)

    def on_disk(self) -> int:
        """Situations in the file, -1 without one."""
        content = self.file.read()
        return -1 if content is None else decode_situations(content)[0].occurrences


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return bench_site(tmp_path / "state")


@pytest.fixture(autouse=True)
def _log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


def test_it_is_there_after_a_restart(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    first = Desk(site)
    work(first.mind, CHUNK + 100)  # a full chunk, and a begun one
    first.keeper.save()
    first.keeper.close(10.0)
    assert first.path.name == "anna.situations.npz"
    again = Desk(site)
    assert same_bits(again.mind.snapshot(), first.mind.snapshot())
    assert f"operator 'anna': {CHUNK + 100} situations of 0.1 h of work known" in caplog.text
    here = np.append(np.tile(first.mind.snapshot()["next_position"][50], 3), 0.0)
    assert len(again.mind.similar(here, 1)) == 1
    saved = again.path.stat().st_mtime_ns
    again.keeper.save()  # nothing is new
    again.keeper.close(10.0)
    assert again.path.stat().st_mtime_ns == saved
    other = Desk(replace(site, operator="ben"))
    assert other.mind.count == 0
    other.keeper.close(10.0)


def test_it_is_saved_once_a_minute_and_less_often_when_it_is_large(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = Desk(site)
    work(desk.mind, 10)
    desk.keeper.keep(SAVE_S - 1.0)
    assert desk.on_disk() == -1
    desk.keeper.keep(SAVE_S)
    until(lambda: desk.on_disk() == 10, 10.0, "10 situations")
    work(desk.mind, 10, 100.0)
    desk.keeper.keep(2.0 * SAVE_S - 1.0)
    assert desk.on_disk() == 10
    monkeypatch.setattr("rampe_guard.runtime.store_situations._BYTES_PER_S", 1.0)
    desk.keeper.keep(2.0 * SAVE_S)
    until(lambda: desk.on_disk() == 20, 10.0, "20 situations")
    work(desk.mind, 10, 200.0)
    desk.keeper.keep(4.0 * SAVE_S)  # 2.7 kB at a byte a second
    assert desk.on_disk() == 20
    desk.keeper.keep(2.0 * SAVE_S + 20 * 8 * (2 + N + 3 * N))
    until(lambda: desk.on_disk() == 30, 10.0, "30 situations")
    desk.keeper.close(10.0)


def test_what_is_taken_for_a_save_is_not_what_comes_after() -> None:
    mind = work(memory(), CHUNK - 10)
    pieces, before = mind.pieces(), mind.snapshot()
    work(mind, 4 * CHUNK, 1000.0)  # fills the chunk, and drives it out in the end
    header = situations_header(some := bench_site(Path("/none")), bench_limits(some))
    found, arrays = decode_situations(encode_situations(header, pieces))
    assert found.occurrences == CHUNK - 10
    assert same_bits(arrays, before)


@pytest.mark.parametrize("damage", ["cut", "bits", "model", "count", "nan"])
def test_what_cannot_be_used_is_set_aside_with_a_word(
    site: Site, caplog: pytest.LogCaptureFixture, damage: str
) -> None:
    header = situations_header(site, bench_limits(site))
    pieces = work(memory(), 50).pieces()
    if damage == "nan":
        pieces[0][1][3, 1] = np.nan
    content = encode_situations(header, pieces)
    if damage == "model":
        content = content.replace(b"rampe.situations.v1", b"rampe.situations.v2")
    if damage == "count":
        content = content.replace(b'"occurrences":50', b'"occurrences":51')
    if damage == "bits":
        content = content[:3000] + bytes([content[3000] ^ 1]) + content[3001:]
    if damage == "cut":
        content = content[:-1]
    with situations_file(model_path(site)) as file:
        file.write(content)
    desk = Desk(site)
    assert desk.mind.count == 0
    assert "anna.situations.npz is not used: " in caplog.text
    assert "It is now anna.situations.npz.refused-1, and no situation is remembered" in caplog.text
    assert desk.keeper.problem is None
    work(desk.mind, 5)
    desk.keeper.save()
    desk.keeper.close(10.0)
    assert desk.on_disk() == 5
    assert desk.path.with_name("anna.situations.npz.refused-1").read_bytes() == content


def test_situations_of_another_machine_are_not_used(site: Site) -> None:
    header = situations_header(site, bench_limits(site))
    content = encode_situations(header, work(memory(), 50).pieces())
    mind = memory()
    fast = replace(site.guard.actuators[0], max_velocity=9.0)
    guard = replace(site.guard, actuators=(fast, *site.guard.actuators[1:]))
    for other, words in (
        (replace(site, machine="crane"), "it is of machine 'bench-excavator', not 'crane'"),
        (replace(site, guard=guard), "it was learned with max_velocity"),
    ):
        needed = situations_header(other, bench_limits(site))
        with pytest.raises(ModelFileError, match=words):
            recall_situations(content, needed, mind)
    with pytest.raises(ModelFileError, match=r"format is 'rampe\.situations\.v1'"):
        decode(content)
    assert mind.count == 0
    assert recall_situations(content, header, mind).occurrences == mind.count == 50


def test_two_guards_never_write_one_memory(site: Site) -> None:
    first = Desk(site)
    work(first.mind, 5)
    first.keeper.save()
    until(lambda: first.on_disk() == 5, 10.0, "5 situations")
    second = Desk(site)
    assert second.mind.count == 5
    assert f"held by a running guard, process {os.getpid()}" in str(second.keeper.problem)
    work(second.mind, 5, 100.0)
    assert second.keeper.save() == 0
    second.keeper.close(10.0)
    first.keeper.close(10.0)


_SAVE_FOR_EVER = """
import sys
from pathlib import Path
from tests.unit.test_store_situations import Desk, bench_site, memory, work
desk = Desk(bench_site(Path(sys.argv[1])))
for k in range(300):
    work(desk.mind, 200, 1000.0 * k)
    desk.keeper.save()
    print(desk.on_disk(), flush=True)
"""


def test_a_kill_at_any_moment_leaves_what_was_saved(site: Site, tmp_path: Path) -> None:
    for _ in range(2):
        child = subprocess.Popen(
            [sys.executable, "-c", _SAVE_FOR_EVER, str(tmp_path / "state")],
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        assert child.stdout is not None
        with child, child.stdout:
            said = [-1]
            while sum(count >= 0 for count in said) < 6:
                said.append(int(child.stdout.readline()))
            child.send_signal(signal.SIGKILL)
        content = ModelFile(situations_file(model_path(site)).path, 1 << 28).read()
        assert content is not None
        assert decode_situations(content)[0].occurrences >= said[-1]
