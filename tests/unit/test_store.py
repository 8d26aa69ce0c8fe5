"""The file of a model: where it is, and that a crash at any moment leaves the old or the new."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.store import ModelFile, model_path, safe_name
from rampe_guard.runtime.store_format import decode, encode
from rampe_guard.settings import load_site
from tests.support.models import bench_site, same_bits, some_arrays, some_header
from tests.support.processes import BENCH, ROOT

OLD, NEW = b"old" * 50, b"new" * 70


def inode(path: Path) -> int:
    return path.stat().st_ino


def test_names_of_files_are_safe_and_short() -> None:
    assert safe_name("excavator-7") == "excavator-7"
    assert safe_name("Anna Müller").startswith("anna-m-ller~")
    for name in ("../../etc/passwd", "..", ".", "/", "a/b", "a\0b", "x" * 64, "語" * 64, "", "-rf"):
        made = safe_name(name)
        assert set(made) <= set("abcdefghijklmnopqrstuvwxyz0123456789-_~")
        assert not made.startswith("-") or "~" in made
        assert 0 < len(made) <= 64


@given(st.text(max_size=64), st.text(max_size=64))
def test_two_names_are_never_one_file(a: str, b: str) -> None:
    assert (safe_name(a) == safe_name(b)) is (a == b)
    assert (safe_name(a).lower() == safe_name(b).lower()) is (a == b)


@pytest.mark.parametrize("pair", [("Anna", "anna"), ("a b", "a-b"), ("é", "e\u0301"), ("a.", "a")])
def test_names_that_look_alike_are_two_files(pair: tuple[str, str]) -> None:
    assert safe_name(pair[0]).lower() != safe_name(pair[1]).lower()


def test_where_models_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = load_site(BENCH)
    tail = Path("bench", "bench-excavator", "operator.npz")
    monkeypatch.setenv("HOME", "/home/anna")
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    assert model_path(site) == Path("/home/anna/.local/state/rampe-guard") / tail
    monkeypatch.setenv("XDG_STATE_HOME", "relative")  # to be ignored
    assert model_path(site) == Path("/home/anna/.local/state/rampe-guard") / tail
    monkeypatch.setenv("XDG_STATE_HOME", "/xdg")
    assert model_path(site) == Path("/xdg/rampe-guard") / tail
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/rampe-guard:/var/lib/other")
    assert model_path(site) == Path("/var/lib/rampe-guard") / tail
    own = replace(site, memory=replace(site.memory, directory=str(tmp_path)))
    assert model_path(own) == tmp_path / tail
    assert model_path(replace(own, operator="Anna")).parent == model_path(own).parent


def test_without_a_home_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nobody)
    with pytest.raises(ModelFileError, match=r"give memory\.directory in the site file"):
        model_path(load_site(BENCH))


def test_write_read_and_privacy(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "anna.npz"
    with ModelFile(path) as file:
        assert file.read() is None
        file.write(OLD)
        file.write(NEW)
        assert file.read() == NEW
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert sorted(p.name for p in path.parent.iterdir()) == ["anna.npz", "anna.npz.lock"]


@pytest.mark.parametrize("action", [lambda f: f.write(OLD), ModelFile.set_aside, ModelFile.delete])
def test_nothing_is_changed_without_the_lock(
    tmp_path: Path, action: Callable[[ModelFile], object]
) -> None:
    with pytest.raises(RuntimeError, match="not locked"):
        action(ModelFile(tmp_path / "anna.npz"))


def test_a_save_cut_at_any_byte_leaves_the_old_model(tmp_path: Path) -> None:
    """The temporary file as a crash at every byte would leave it, then what a start finds."""
    header = some_header(bench_site(tmp_path))
    old, new = some_arrays(1), some_arrays(2)
    path = tmp_path / "anna.npz"
    with ModelFile(path) as file:
        file.write(encode(header, old))
    content = encode(header, new)
    temporary = path.with_name("anna.npz.tmp")
    for end in range(len(content) + 1):
        temporary.write_bytes(content[:end])
        with ModelFile(path) as file:
            found = file.read()
            assert found is not None
            assert same_bits(decode(found)[1], old)
            assert not temporary.exists()
    with ModelFile(path) as file:
        file.write(content)
        found = file.read()
        assert found is not None
        assert same_bits(decode(found)[1], new)


KILLS = """
import os, signal, sys, time
from pathlib import Path
from rampe_guard.runtime.store import ModelFile

path = Path(sys.argv[1])
contents = [p.read_bytes() for p in sorted(path.parent.glob("*.content"))]
for k in range(int(sys.argv[2])):
    read_end, write_end = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            with ModelFile(path) as file:
                while True:
                    for content in contents:
                        file.write(content)
                        os.write(write_end, b"x")
        finally:
            os._exit(1)
    os.read(read_end, 1)  # one save is done
    time.sleep(0.0003 * k)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    os.close(read_end), os.close(write_end)
    cut = path.with_name(path.name + ".tmp").exists()
    with ModelFile(path) as file:  # the kernel gave the lock back
        found = file.read()
        left = path.with_name(path.name + ".tmp").exists()
    print(contents.index(found) if found in contents else "torn", cut, left, flush=True)
"""


def test_a_kill_at_any_moment_of_saving_leaves_a_whole_model(tmp_path: Path) -> None:
    header = some_header(bench_site(tmp_path))
    for seed in range(4):
        (tmp_path / f"{seed}.content").write_bytes(encode(header, some_arrays(seed)))
    command = [sys.executable, "-c", KILLS, str(tmp_path / "anna.npz"), "150"]
    done = subprocess.run(command, check=True, capture_output=True, cwd=ROOT, encoding="utf-8")
    found, cut, left = zip(*(line.split() for line in done.stdout.splitlines()), strict=True)
    assert len(found) == 150
    assert set(found) <= {"0", "1", "2", "3"}
    assert set(left) == {"False"}
    assert len(set(found)) > 1, "all were killed at the same save: this showed little"
    assert "True" in cut, "no kill came in the middle of a save: this showed nothing"


def test_only_one_process_holds_a_model(tmp_path: Path) -> None:
    path = tmp_path / "anna.npz"
    with ModelFile(path):
        with pytest.raises(ModelFileError, match=f"held by a running guard, process {os.getpid()}"):
            ModelFile(path).lock()
        with ModelFile(tmp_path / "ben.npz"):
            pass
    with ModelFile(path):
        pass


def test_a_lock_whose_file_was_deleted_meanwhile_is_taken_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "anna.npz"
    lock_path = path.with_name("anna.npz.lock")
    flock = fcntl.flock
    deleted: list[int] = []

    def deletes_once(descriptor: int, how: int) -> None:
        flock(descriptor, how)
        if not deleted:
            deleted.append(inode(lock_path))
            lock_path.unlink()  # another process resets the model at this very moment

    monkeypatch.setattr(fcntl, "flock", deletes_once)
    with ModelFile(path), pytest.raises(ModelFileError, match="held by"):
        ModelFile(path).lock()
    assert deleted


def test_a_failed_save_keeps_the_old_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "anna.npz"
    with ModelFile(path) as file:
        file.write(OLD)

        def full(_descriptor: int) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(ModelFileError, match=r"anna\.npz: No space left on device"):
            file.write(NEW)
        assert file.read() == OLD
        assert sorted(p.name for p in tmp_path.iterdir()) == ["anna.npz", "anna.npz.lock"]


def test_a_save_reaches_the_disk_before_it_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """File synced, then renamed, then the folder synced: in this order."""
    path = tmp_path / "anna.npz"
    done: list[str] = []
    fsync, rename = os.fsync, Path.replace

    def noted_fsync(descriptor: int) -> None:
        done.append(Path(f"/proc/self/fd/{descriptor}").readlink().name)
        fsync(descriptor)

    def noted_rename(source: Path, target: Path) -> Path:
        done.append("rename")
        return rename(source, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(Path, "replace", noted_rename)
    with ModelFile(path) as file:
        file.write(OLD)
    assert done == ["anna.npz.tmp", "rename", tmp_path.name]


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(ModelFileError, match="File exists"):
        ModelFile(tmp_path / "file" / "anna.npz").lock()


def test_what_is_no_regular_file_is_not_read(tmp_path: Path) -> None:
    pipe, folder, large = (tmp_path / name for name in ("pipe.npz", "folder.npz", "large.npz"))
    os.mkfifo(pipe)
    folder.mkdir()
    large.write_bytes(b"12345")
    for path, expected in (
        (pipe, "not a regular"),
        (folder, "not a regular"),
        (large, "too much for a model"),
    ):
        with pytest.raises(ModelFileError, match=expected):
            ModelFile(path, 4).read()
    loop = tmp_path / "loop.npz"
    loop.symlink_to(loop)
    with pytest.raises(ModelFileError, match="cannot be read: Too many levels"):
        ModelFile(loop).read()
    assert ModelFile(large / "anna.npz").read() is None


def test_set_aside_never_overwrites(tmp_path: Path) -> None:
    path = tmp_path / "anna.npz"
    with ModelFile(path) as file:
        for content in (OLD, NEW):
            file.write(content)
            file.set_aside()
        assert file.read() is None
    assert (tmp_path / "anna.npz.refused-1").read_bytes() == OLD
    assert (tmp_path / "anna.npz.refused-2").read_bytes() == NEW


def test_delete_forgets_one_operator_wholly(tmp_path: Path) -> None:
    other = tmp_path / "anna-b.npz"
    with ModelFile(other) as file:
        file.write(NEW)
        file.set_aside()
        file.write(NEW)
    path = tmp_path / "anna.npz"
    with ModelFile(path) as file:
        file.write(OLD)
        file.set_aside()
        file.write(OLD)
        deleted = file.delete()
    assert deleted == [path, tmp_path / "anna.npz.refused-1"]
    left = sorted(p.name for p in tmp_path.iterdir())
    assert left == ["anna-b.npz", "anna-b.npz.lock", "anna-b.npz.refused-1"]
