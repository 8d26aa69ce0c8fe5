"""The memory of a running guard: recalls, saves in time and in order, and never gets in the way."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import pytest

from rampe_guard.core.types import Category, FloatArray
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime import store_keeper
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_path
from rampe_guard.runtime.store_format import Header, decode, encode
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.store_saver import Save, Saver
from rampe_guard.settings import Site
from tests.support.models import bench_limits, bench_site, some_header
from tests.support.processes import until

DIG: Category = (0, 1, 1, 0)
SWING: Category = (1, 0, 0, 0)


@dataclass(frozen=True)
class Row:
    occurrences: int
    mean_displacement: FloatArray


class Notebook:
    """The simplest thing that learns: a mean a category."""

    def __init__(self) -> None:
        self.means: dict[Category, tuple[int, FloatArray]] = {}
        self.refused: dict[str, int] = {"too_short": 2}

    @property
    def categories(self) -> dict[Category, int]:
        return {category: count for category, (count, _) in self.means.items()}

    def learn(self, category: Category, x: float) -> None:
        count, mean = self.means.get(category, (0, np.zeros(4)))
        self.means[category] = (count + 1, mean + (x - mean) / (count + 1))

    def snapshot(self) -> dict[str, npt.NDArray[Any]]:
        counts = [count for count, _ in self.means.values()]
        return {
            "category": np.array(list(self.means), np.int8).reshape(-1, 4),
            "count": np.array(counts, np.int64),
            "mean": np.array([mean for _, mean in self.means.values()]).reshape(-1, 4),
        }

    def restore(self, snapshot: Mapping[str, npt.NDArray[Any]]) -> None:
        rows = zip(snapshot["category"], snapshot["count"], snapshot["mean"], strict=True)
        self.means = {tuple(c.tolist()): (int(n), m) for c, n, m in rows}
        if any(n < 0 for n, _ in self.means.values()):
            raise ValueError("a count is negative")

    def table(self) -> list[Row]:
        return [Row(count, mean) for count, mean in self.means.values()]


class Desk:
    """A keeper with its learner and log, as a guard has them; time is passed in."""

    def __init__(self, site: Site) -> None:
        self.notebook = Notebook()
        self.path = model_path(site)
        self.keeper = Keeper(site, bench_limits(site), Sayer("rampe_guard.test"))

    def begin(self) -> Desk:
        self.keeper.begin(self.notebook, 0.0)
        return self

    def on_disk(self) -> Header | None:
        return decode(self.path.read_bytes())[0] if self.path.exists() else None

    def wait_for(self, occurrences: int) -> None:
        def there() -> bool:
            header = self.on_disk()
            return header is not None and header.occurrences == occurrences

        until(there, 10.0, f"{occurrences} occurrences on disk")


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return bench_site(tmp_path / "state")


@pytest.fixture(autouse=True)
def _log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


def learned_before(site: Site) -> Path:
    """A model of 2 + 1 occurrences, as an earlier run left it."""
    desk = Desk(site).begin()
    for category, x in ((DIG, 0.5), (DIG, 0.7), (SWING, -0.25)):
        desk.notebook.learn(category, x)
    desk.keeper.close()
    return desk.path


def test_what_was_learned_is_there_after_a_restart(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    path = learned_before(site)
    assert f"operator 'anna': nothing learned yet, there is no {path}" in caplog.text
    desk = Desk(site).begin()
    assert desk.notebook.categories == {DIG: 2, SWING: 1}
    assert desk.notebook.means[SWING][1].tolist() == [-0.25] * 4
    assert "operator 'anna': 3 primitives of 2 categories known from" in caplog.text
    assert desk.keeper.reasons() == ()
    header = desk.on_disk()
    assert header is not None
    assert (header.site, header.machine, header.operator) == ("bench", "bench-excavator", "anna")
    assert (header.categories, header.occurrences, header.refused) == (2, 3, {"too_short": 2})
    assert abs(header.saved_unix_s - time.time()) < 1000.0
    desk.keeper.close()


def test_each_operator_has_a_model_of_his_own(site: Site) -> None:
    learned_before(site)
    desk = Desk(replace(site, operator="ben")).begin()
    assert desk.notebook.categories == {}
    desk.keeper.close()


def test_saved_when_due_and_only_if_something_was_learned(site: Site) -> None:
    desk = Desk(site).begin()
    desk.keeper.keep(31.0)
    desk.notebook.learn(DIG, 1.0)
    desk.keeper.keep(60.0)  # the next save is due at 61
    desk.notebook.learn(DIG, 1.0)
    assert desk.on_disk() is None
    desk.keeper.keep(61.0)
    desk.wait_for(2)
    first = desk.path.stat()
    desk.keeper.keep(100.0)
    desk.keeper.close()
    assert desk.path.stat() == first  # nothing new, nothing written


def test_nothing_is_written_when_nothing_was_learned(site: Site) -> None:
    Desk(site).begin().keeper.close()
    assert not model_path(site).exists()


def test_memory_can_be_off(site: Site, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    off = replace(site, memory=replace(site.memory, enabled=False))
    desk = Desk(off).begin()
    desk.notebook.learn(DIG, 1.0)
    desk.keeper.keep(1000.0)
    desk.keeper.close()
    assert "memory is off" in caplog.text
    assert desk.keeper.reasons() == ()
    assert list(tmp_path.iterdir()) == []


def cut(content: bytes) -> bytes:
    return content[:-1]


def other_version(content: bytes) -> bytes:
    header, arrays = decode(content)
    return encode(msgspec.structs.replace(header, format="rampe.model.v2"), arrays)


def other_actuators(content: bytes) -> bytes:
    header, arrays = decode(content)
    swapped = msgspec.structs.replace(header, actuators=header.actuators[::-1])
    return encode(swapped, arrays)


def other_count(content: bytes) -> bytes:
    header, arrays = decode(content)
    return encode(msgspec.structs.replace(header, occurrences=9), arrays)


def negative_count(content: bytes) -> bytes:
    header, arrays = decode(content)
    return encode(header, {**arrays, "count": np.array([-2, 5])})


def not_a_number(content: bytes) -> bytes:
    header, arrays = decode(content)
    return encode(header, {**arrays, "mean": np.full((2, 4), np.nan)})


def array_missing(content: bytes) -> bytes:
    header, arrays = decode(content)
    return encode(header, {"count": arrays["count"]})


def nothing(_content: bytes) -> bytes:
    return b""


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (cut, "damaged"),
        (nothing, "damaged"),
        (other_version, "its format is 'rampe.model.v2', and this version"),
        (other_actuators, "its actuators are bucket [m], stick [m], boom [m], swing [rad]; those"),
        (other_count, "3 occurrences of 2 categories where the header says 9 of 2"),
        (negative_count, "a count is negative"),
        (not_a_number, "a mean displacement is [nan"),
        (array_missing, "'category'"),
    ],
)
def test_a_file_that_cannot_be_used_is_set_aside_and_the_guard_learns_anew(
    site: Site, caplog: pytest.LogCaptureFixture, spoil: Callable[[bytes], bytes], reason: str
) -> None:
    path = learned_before(site)
    bad = spoil(path.read_bytes())
    path.write_bytes(bad)
    caplog.clear()
    desk = Desk(site).begin()
    assert desk.notebook.categories == {}
    aside = path.with_name("anna.npz.refused-1")
    assert aside.read_bytes() == bad
    (said,) = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    for words in (str(path), reason, aside.name, "nothing learned", "rename it back, or delete it"):
        assert words in said
    desk.notebook.learn(SWING, 1.0)
    desk.keeper.close()
    assert desk.keeper.reasons() == ()
    header = desk.on_disk()
    assert header is not None
    assert header.occurrences == 1
    assert aside.read_bytes() == bad


def test_a_bad_file_that_cannot_be_moved_is_not_overwritten(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = learned_before(site)
    path.write_bytes(b"precious")

    def denied(_path: Path, _target: Path) -> Path:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "rename", denied)
    desk = Desk(site).begin()
    desk.notebook.learn(SWING, 1.0)
    desk.keeper.keep(1000.0)
    (reason,) = desk.keeper.reasons()
    assert reason.code == "model_not_kept"
    assert "nor moved aside" in reason.text
    desk.keeper.close()
    assert path.read_bytes() == b"precious"


def test_a_model_that_another_guard_holds_is_used_but_not_written(site: Site) -> None:
    path = learned_before(site)
    before = path.read_bytes()
    with ModelFile(path):
        desk = Desk(site).begin()
        assert desk.notebook.categories == {DIG: 2, SWING: 1}
        desk.notebook.learn(SWING, 1.0)
        desk.keeper.keep(1000.0)
        (reason,) = desk.keeper.reasons()
        assert "is held by a running guard" in reason.text
        desk.keeper.close()
        path.write_bytes(b"bad, but not ours to move")
        desk = Desk(site).begin()
        assert desk.notebook.categories == {}
        desk.keeper.close()
        assert path.exists()
        path.write_bytes(before)
    assert path.read_bytes() == before


def test_a_folder_that_cannot_be_written_is_said_and_the_guard_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "state").write_bytes(b"a file, no folder")
    desk = Desk(bench_site(tmp_path / "state")).begin()
    desk.notebook.learn(DIG, 1.0)
    desk.keeper.keep(1000.0)
    for _ in range(3):
        (reason,) = desk.keeper.reasons()
    assert "what is learned is not kept" in reason.text
    assert caplog.text.count("what is learned is not kept") == 1
    desk.keeper.close()


def test_without_a_home_the_guard_goes_on(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    def nowhere(_site: Site) -> Path:
        raise ModelFileError("there is no home directory")

    desk = Desk(site)
    monkeypatch.setattr(store_keeper, "model_path", nowhere)
    desk.begin()
    desk.keeper.keep(1000.0)
    assert "no home" in desk.keeper.reasons()[0].text
    desk.keeper.close()


def test_a_full_disk_is_said_until_it_is_over(
    site: Site, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    desk = Desk(site).begin()

    def full(_file: ModelFile, _content: bytes) -> None:
        raise ModelFileError("anna.npz: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(ModelFile, "write", full)
        desk.notebook.learn(DIG, 1.0)
        desk.keeper.keep(30.0)
        until(desk.keeper.reasons, 10.0, "a reason")
        assert "No space left" in desk.keeper.reasons()[0].text
    desk.keeper.keep(60.0)  # nothing new was learned, but the last save failed
    desk.wait_for(1)
    until(lambda: not desk.keeper.reasons(), 10.0, "no reason any more")
    assert "what is learned is kept again" in caplog.text
    desk.keeper.close()


class SlowDisk:
    """Lets a write wait until it is told to go on; notes how many write at once."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.go_on, self.started = threading.Event(), threading.Event()
        self.at_once, self.most, self.written = 0, 0, [0]
        really = ModelFile.write

        def write(file: ModelFile, content: bytes) -> None:
            self.at_once += 1
            self.most = max(self.most, self.at_once)
            self.started.set()
            self.go_on.wait(30.0)
            self.written.append(decode(content)[0].occurrences)
            really(file, content)
            self.at_once -= 1

        monkeypatch.setattr(ModelFile, "write", write)


def test_a_slow_disk_never_holds_the_worker_and_the_newest_wins(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = SlowDisk(monkeypatch)
    desk = Desk(site).begin()
    for k in range(1, 20):
        desk.notebook.learn(DIG, 1.0)
        desk.keeper.keep(30.0 * k)  # returns although the first write still waits
        assert disk.started.wait(10.0)
    assert disk.written == [0]
    disk.go_on.set()
    desk.wait_for(19)
    desk.keeper.close()
    assert disk.written == [0, 1, 19]
    assert disk.most == 1


def test_a_disk_that_hangs_at_the_end_is_given_up(
    site: Site, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(store_keeper, "_END_S", 0.05)
    disk = SlowDisk(monkeypatch)
    desk = Desk(site).begin()
    desk.notebook.learn(DIG, 1.0)
    desk.keeper.close()
    assert "did not take the last save in time" in caplog.text
    with pytest.raises(ModelFileError, match="held"):  # it may still be written
        ModelFile(desk.path).lock()
    disk.go_on.set()
    desk.wait_for(1)


def test_the_last_save_is_the_newest(site: Site) -> None:
    desk = Desk(site).begin()
    for k in range(50):
        desk.notebook.learn(DIG, float(k))
        desk.keeper.keep(30.0 * (k + 1))
    desk.keeper.close()
    header = desk.on_disk()
    assert header is not None
    assert header.occurrences == 50


def test_a_last_save_that_fails_is_said(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    desk = Desk(site).begin()
    desk.notebook.snapshot = lambda: {"a": np.array([None])}  # type: ignore[method-assign]
    desk.notebook.learn(DIG, 1.0)
    desk.keeper.close()
    assert "what was learned last is not kept: array 'a' is of type object" in caplog.text
    with ModelFile(desk.path):  # free again
        pass


def test_leaving_the_context_saves(site: Site) -> None:
    desk = Desk(site)
    with desk.keeper as keeper:
        keeper.begin(desk.notebook, 0.0)
        desk.notebook.learn(DIG, 1.0)
    header = desk.on_disk()
    assert header is not None
    assert header.occurrences == 1
    assert some_header(site).actuators == header.actuators


def test_no_fault_ends_the_saving(tmp_path: Path) -> None:
    """Not even one of ours, of which nobody has thought."""

    def broken() -> bytes:
        raise RuntimeError("dictionary changed size during iteration")

    file = ModelFile(tmp_path / "model.npz")
    file.lock()
    saver = Saver(file, 0)
    saver.give(Save(broken, 1))
    until(lambda: saver.failures == 1, 5.0, "the fault counted")
    assert "changed size" in (saver.problem or "")
    assert saver.taken == 0
    saver.give(Save(lambda: b"good", 2))
    until(lambda: saver.problem is None, 5.0, "saved after all")
    assert saver.finish(5.0)
    file.release()
    assert file.path.read_bytes() == b"good"
