"""MCAP files of ours: what a foreign reader finds, what a cut or damage leaves, and full disks."""

from __future__ import annotations

import errno
import os
from collections import Counter
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Footer
from mcap.stream_reader import StreamReader

from rampe_guard.errors import LogError
from rampe_guard.recording.channels import channels_of
from rampe_guard.recording.reader import McapReading
from rampe_guard.recording.series import Rotation, Series
from rampe_guard.recording.writer import Entry, Head
from rampe_guard.settings import Site
from tests.support.recording_files import START_NS, entry, small_site, write

NOTHING = Head({}, {})
NEVER = Rotation.of(1e6, 1e6)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    return small_site(tmp_path_factory.mktemp("site"))


def frames(site: Site, count: int, start: int = 0) -> list[Entry]:
    found = []
    for k in range(start, start + count):
        found.append(entry(site, 0.05 * k, "joystick", {"stamp": 0.05 * k, "axes": [0.5]}))
        found.append(entry(site, 0.05 * k, "actuators", {"stamp": 0.05 * k, "position": [0.1]}))
    return found


def test_a_foreign_reader_finds_channels_schemas_counts_and_attachments(
    site: Site, tmp_path: Path
) -> None:
    rubbish = [entry(site, 9.0, "joystick", b"\xff{")]
    wild = [entry(site, 9.1, "joystick", {"axes": [0.0]}, key="r/*")]
    path = write(site, tmp_path / "a.mcap", [frames(site, 10), frames(site, 10, 10), rubbish, wild])
    with path.open("rb") as file:
        reader = make_reader(file)
        header, summary = reader.get_header(), reader.get_summary()
        assert (header.profile, header.library.split()[0]) == ("", "rampe-guard")
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 42
        counts = Counter[str]()
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            counts[channel.topic] += 1
            if message.data != b"\xff{":
                said = msgspec.json.decode(message.data)
                jsonschema.Draft202012Validator(msgspec.json.decode(schema.data)).validate(said)
                if "stamp" in said:
                    assert message.publish_time == int(said["stamp"] * 1e9)
                assert START_NS <= message.log_time < START_NS + 10 * 10**9
        assert counts == {"r/joystick": 21, "r/actuators": 20, "r/*": 1}
        roles = {c.metadata["rampe.role"] for c in summary.channels.values()}
        assert roles == {c.role for c in channels_of(site)}
        names = {a.name for a in reader.iter_attachments()}
        assert names == {"files/site.yaml", "files/scene.yaml", "files/slider.urdf"}
        file.seek(0)
        records = list(StreamReader(file, validate_crcs=True).records)  # to its last byte
        assert isinstance(records[-1], Footer)


@pytest.fixture(scope="module")
def whole(site: Site, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    batches = [frames(site, 5, 5 * k) for k in range(6)]
    return write(site, path, batches, Head({}, {"files/x": b"x" * 300})).read_bytes()


def read(content: bytes, path: Path) -> tuple[list[tuple[int, bytes]], tuple[str, ...]]:
    path.write_bytes(content)
    reading = McapReading(path)
    return [(m.at_ns, m.payload) for m in reading.messages()], reading.warnings


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_cut_anywhere_it_reads_whole_batches_or_says_why_not(
    data: st.DataObject, whole: bytes, site: Site, tmp_path_factory: pytest.TempPathFactory
) -> None:
    cut = data.draw(st.integers(0, len(whole) - 1))
    tail = data.draw(st.sampled_from([b"", b"\0" * 5000]))  # what some file systems leave
    path = tmp_path_factory.getbasetemp() / "cut.mcap"
    written = [(e.at_ns, e.payload) for e in frames(site, 30)]
    try:
        got, warnings = read(whole[:cut] + tail, path)
    except LogError:
        assert cut < len(whole) / 2  # else something of it is there
        return
    assert got == written[: len(got)]
    assert len(got) % 10 == 0
    assert warnings or len(got) == len(written)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_a_flipped_bit_never_becomes_a_message(
    data: st.DataObject, whole: bytes, site: Site, tmp_path_factory: pytest.TempPathFactory
) -> None:
    at = data.draw(st.integers(0, len(whole) - 1))
    content = bytearray(whole)
    content[at] ^= 1 << data.draw(st.integers(0, 7))
    written = [(e.at_ns, e.payload) for e in frames(site, 30)]
    try:
        got, warnings = read(bytes(content), tmp_path_factory.getbasetemp() / "flip.mcap")
    except LogError:
        return
    assert got == sorted(set(got) & set(written), key=written.index)
    assert warnings or got == written


def test_a_file_that_is_none_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"t,u,q\n0,0,0\n")
    with pytest.raises(LogError, match=r"a\.mcap: is no MCAP file"):
        McapReading(path)
    with pytest.raises(LogError, match="No such file"):
        McapReading(tmp_path / "none.mcap")


def test_messages_out_of_order_are_refused(site: Site, tmp_path: Path) -> None:
    batches = [frames(site, 2, 10), frames(site, 2, 0)]
    path = write(site, tmp_path / "a.mcap", batches)
    with pytest.raises(LogError, match="not in order of time"):
        McapReading(path)


def all_of(files: list[Path]) -> list[bytes]:
    return [m.payload for path in files for m in McapReading(path).messages()]


def test_rotation_by_size_and_by_age_loses_nothing(site: Site, tmp_path: Path) -> None:
    for name, rotation in (("size", Rotation.of(0.01, 1e6)), ("age", Rotation.of(1e6, 1 / 60))):
        head = Head({}, {"files/site.yaml": os.urandom(5000)})
        channels = channels_of(site)
        series = Series(tmp_path / f"{name}.mcap", channels, lambda _, h=head: h, rotation)  # type: ignore[misc]
        sent = frames(site, 120)
        for k in range(0, len(sent), 12):
            series.append(sent[k : k + 12])
        series.finish({})
        assert [p.name for p in series.begun[:2]] == [f"{name}.mcap", f"{name}-0002.mcap"]
        assert len(series.begun) > 2
        assert all_of(series.begun) == [e.payload for e in sent]
        assert series.messages == len(sent)
        assert series.written_bytes == sum(p.stat().st_size for p in series.begun)
        assert all("files/site.yaml" in names(p) for p in series.begun)


def names(path: Path) -> list[str]:
    with path.open("rb") as file:
        return [a.name for a in make_reader(file).iter_attachments()]


def test_what_is_there_is_never_overwritten(site: Site, tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("mine")
    series = Series(tmp_path / "a.mcap", channels_of(site), lambda _: NOTHING, NEVER)
    series.append(frames(site, 1))
    series.finish({})
    assert [p.name for p in series.begun] == ["a-0002.mcap"]
    assert (tmp_path / "a.mcap").read_text() == "mine"


def test_a_full_disk_gives_the_batch_back_and_the_next_file_begins_with_it(
    site: Site, tmp_path: Path
) -> None:
    series = Series(tmp_path / "a.mcap", channels_of(site), lambda _: NOTHING, NEVER)
    first, second = frames(site, 20), frames(site, 20, 20)
    series.append(first)
    assert series._file is not None
    os.dup2(os.open("/dev/full", os.O_WRONLY | os.O_CLOEXEC), series._file._file)
    with pytest.raises(OSError, match="No space left") as full:
        series.append(second)
    assert full.value.errno == errno.ENOSPC
    assert series.current is None
    assert series.messages == len(first)
    series.append(second)  # there is room again
    series.finish({})
    assert [p.name for p in series.begun] == ["a.mcap", "a-0002.mcap"]
    assert all_of(series.begun) == [e.payload for e in (*first, *second)]
    assert "was not finished" in McapReading(series.begun[0]).warnings[0]


def test_a_file_that_somebody_deletes_is_followed_by_another(site: Site, tmp_path: Path) -> None:
    series = Series(tmp_path / "a.mcap", channels_of(site), lambda _: NOTHING, NEVER)
    series.append(frames(site, 5))
    (tmp_path / "a.mcap").unlink()
    with pytest.raises(FileNotFoundError, match="was deleted while it was written"):
        series.append(frames(site, 5, 5))
    series.append(frames(site, 5, 5))
    series.finish({})
    assert all_of([tmp_path / "a-0002.mcap"]) == [e.payload for e in frames(site, 5, 5)]


def test_a_file_that_cannot_even_begin_leaves_none(site: Site, tmp_path: Path) -> None:
    series = Series(tmp_path / "no" / "a.mcap", channels_of(site), lambda _: NOTHING, NEVER)
    with pytest.raises(FileNotFoundError):
        series.append(frames(site, 1))
    assert series.begun == []
    (tmp_path / "no").mkdir()
    series.append(frames(site, 1))
    series.finish({})
    assert all_of(series.begun) == [e.payload for e in frames(site, 1)]
