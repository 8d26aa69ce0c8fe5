"""What waits is bounded and counted; each file begins with what the guard really used."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rampe_guard import wire
from rampe_guard.assembly import load_machine
from rampe_guard.core.guard import Guard
from rampe_guard.core.situation import Likeness
from rampe_guard.programs.recording import GUARD, _Beginning, summary
from rampe_guard.programs.replaying import _recall
from rampe_guard.recording import McapLog, McapReading
from rampe_guard.recording.backlog import Backlog
from rampe_guard.recording.bundle import gather
from rampe_guard.recording.recorded_site import learned_before, other_files
from rampe_guard.recording.recorder import Ended
from rampe_guard.recording.taps import Clock
from rampe_guard.recording.writer import METADATA, MODEL, SITUATIONS, Head
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import model_path, situations_file
from rampe_guard.runtime.store_format import encode, header_of, situations_header
from rampe_guard.runtime.store_keeper import counted
from rampe_guard.runtime.store_situations import encode_situations
from rampe_guard.settings import Site
from tests.support.messages import HEARTBEAT
from tests.support.recording_files import entry, small_site, write

_SITE = "site file or URDF"


@pytest.fixture
def site(tmp_path: Path) -> Site:
    made = small_site(tmp_path)
    memory = replace(made.memory, directory=str(tmp_path / "models"))
    return replace(made, memory=memory, operator="anna")


def beginning(site: Site) -> _Beginning:
    return _Beginning(site, gather(site), Clock(), Sayer("rampe_guard.test"))


def test_a_full_backlog_keeps_the_oldest_and_counts_the_rest(site: Site) -> None:
    entries = [entry(site, k, "joystick", b"x" * 700) for k in range(10)]
    backlog = Backlog(max_bytes=5 * 1000)
    backlog.put(entries)
    assert backlog.first() == entries[:5]
    assert (len(backlog), backlog.dropped) == (5, 5)
    backlog.written(2)
    backlog.put(entries[7:])
    assert backlog.first() == [*entries[2:5], *entries[7:9]]
    assert backlog.dropped == 6
    backlog.give_up()
    assert (len(backlog), backlog.dropped) == (0, 11)


def test_what_came_at_once_is_not_torn_apart(site: Site) -> None:
    backlog = Backlog()
    entries = [entry(site, k // 3000, "joystick", b"") for k in range(9000)]
    backlog.put(entries)
    sizes = []
    while batch := backlog.first():
        sizes.append(len(batch))
        backlog.written(len(batch))
    assert sizes == [6000, 3000]


def test_the_summary_does_not_hide_a_loss() -> None:
    files = [Path("a.mcap"), Path("a-0002.mcap"), Path("a-0003.mcap")]
    assert summary(Ended(10, 0, 2_000_000), files[:1]) == (
        "10 messages, 2.0 MB in 1 file (a.mcap), none lost"
    )
    assert summary(Ended(10, 3, 2_000_000), files).endswith(
        "in 3 files (a.mcap … a-0003.mcap), 3 messages LOST"
    )


def test_a_guard_with_other_files_is_told_once_and_noted(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    begun = beginning(site)
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            begun.notice(entry(site, 0.0, "heartbeat", b"{"))
            begun.notice(entry(site, 0.0, "heartbeat", beat("beef", "cafe")))
    assert len(caplog.records) == 1
    assert "works with another site file or URDF than" in caplog.text
    words = begun.head(2).metadata
    assert words[GUARD]["scene_hash"] == "cafe"
    assert (words[METADATA]["number"], words[METADATA]["operator"]) == ("2", "anna")


def test_a_recording_tells_if_its_guard_read_other_files(site: Site, tmp_path: Path) -> None:
    head = beginning(site).head(1)
    ours = site.content_hash, site.scene.content_hash
    for hashes, found in ((ours, ()), ((ours[0], "cafe"), ("scene",)), (("", ours[1]), (_SITE,))):
        beats = [entry(site, 0.0, "heartbeat", b"{"), entry(site, 0.1, "heartbeat", beat(*hashes))]
        path = tmp_path / f"{len(list(tmp_path.glob('*.mcap')))}.mcap"
        assert other_files(McapReading(write(site, path, [beats], head))) == found


def beat(config_hash: str, scene_hash: str) -> bytes:
    hashes = {"config_hash": config_hash, "scene_hash": scene_hash}
    return wire.encode(msgspec.structs.replace(HEARTBEAT, **hashes))


def taught(site: Site) -> tuple[Guard, bytes]:
    """A guard that has learned a little, and its model as it would be kept."""
    machine = load_machine(site)
    guard = machine.guard(0.0, "x")
    for k in range(4):
        guard.rampe.observe((1,), np.array([0.1 * k]), np.array([0.5]))
    header = counted(header_of(site, machine.arm.limits), guard.rampe)
    return guard, encode(header, dict(guard.rampe.snapshot()))


def test_what_was_learned_goes_along_and_is_where_a_replay_begins(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not any(name.startswith(MODEL) for name in beginning(site).head(1).attachments)
    before, content = taught(site)
    path = model_path(site)
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    head = beginning(site).head(1)
    assert head.attachments[f"{MODEL}anna.npz"] == content

    file = write(site, tmp_path / "a.mcap", [[entry(site, 0.0, "joystick", b"")]], head)
    machine, reading = load_machine(site), McapReading(file)
    assert learned_before(reading) == content
    log = McapLog(site, reading, machine.arm.limits)
    guard = machine.guard(0.0, "y")
    _recall(machine, log, guard)
    assert guard.rampe.categories == before.rampe.categories == {(1,): 4}

    bad = Head(head.metadata, {**head.attachments, f"{MODEL}anna.npz": content[:-40]})
    file = write(site, tmp_path / "b.mcap", [[entry(site, 0.0, "joystick", b"")]], bad)
    fresh = machine.guard(0.0, "z")
    _recall(machine, McapLog(site, McapReading(file), machine.arm.limits), fresh)
    assert fresh.rampe.categories == {}
    assert "what was learned before the recording is not used" in capsys.readouterr().err


def test_situations_go_along_and_are_where_a_replay_begins(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = load_machine(site)
    before = machine.guard(0.0, "x").situations
    likeness = Likeness(np.ones(1))
    for k in range(40):
        before.see(0.1 * k, np.array([0.1 * k]), np.full(likeness.size, 0.1 * k))
    header = situations_header(site, machine.arm.limits)
    content = encode_situations(header, before.pieces())
    with situations_file(model_path(site)) as file:
        file.write(content)
    head = beginning(site).head(1)
    assert head.attachments[f"{SITUATIONS}anna.situations.npz"] == content
    for damage, count, said in ((0, 40, False), (40, 0, True)):
        name = f"{SITUATIONS}anna.situations.npz"
        kept = {**head.attachments, name: content[: len(content) - damage]}
        moved = [[entry(site, 0.0, "joystick", b"")]]
        log = write(site, tmp_path / f"{damage}.mcap", moved, Head(head.metadata, kept))
        guard = machine.guard(0.0, "y")
        _recall(machine, McapLog(site, McapReading(log), machine.arm.limits), guard)
        assert guard.situations.count == count
        assert ("was remembered before the recording is not" in capsys.readouterr().err) is said
