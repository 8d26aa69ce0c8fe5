"""Files that somebody made to read, fetch, run or fill something: refused, and nothing was."""

from __future__ import annotations

import json
import os
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import trimesh
import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk

from rampe_guard.collision import load_arm
from rampe_guard.collision.mesh import load_mesh
from rampe_guard.collision.mesh_read import FORMATS
from rampe_guard.collision.xml_check import MAX_DEPTH
from rampe_guard.errors import GeometryError, LogError, SettingsError
from rampe_guard.recording.reader import MAX_CHUNK, McapReading, unpacked
from rampe_guard.recording.recorded_site import recorded_site
from rampe_guard.recording.writer import FILES, METADATA, Head
from rampe_guard.settings import load_site
from tests.support.arms import box_triangles, write_stl
from tests.support.recording_files import entry, head_of, small_site, write

URDF = '<robot name="two"><link name="rail"/>{}</robot>'
LAUGHS = '<!DOCTYPE robot [<!ENTITY a "ha">{}]>\n'.format(
    "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
)
OUTSIDE = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>\n'


@pytest.fixture(autouse=True)
def nothing_is_fetched_or_run() -> Iterator[None]:
    """Fails the test if it connects anywhere or starts anything."""
    seen: list[str] = []
    watched = {"socket.connect", "socket.getaddrinfo", "os.system", "subprocess.Popen", "os.exec"}
    watched |= {"pickle.find_class"}
    on = True

    def hook(event: str, args: tuple[object, ...]) -> None:
        if on and event in watched:
            seen.append(f"{event} {args!r}"[:200])

    sys.addaudithook(hook)  # stays until the end of the process, and does nothing then
    yield
    on = False
    assert not seen


def sited(folder: Path, urdf: str | bytes) -> Path:
    content = urdf if isinstance(urdf, bytes) else urdf.encode()
    small_site(folder)
    (folder / "slider.urdf").write_bytes(content)
    return folder / "site.yaml"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (LAUGHS + URDF.format('<link name="&i;"/>'), "has a document type"),
        (OUTSIDE + URDF.format('<link name="&x;"/>'), "has a document type"),
        ('<!DOCTYPE robot SYSTEM "http://127.0.0.1:1/x.dtd">' + URDF.format(""), "document type"),
        ((LAUGHS + URDF.format("")).encode("utf-16"), "has a document type"),
        (b'<?xml version="1.0" encoding="utf-7"?><robot/>', "not well-formed"),
        (URDF.format("<a>" * 1000 + "</a>" * 1000), f"deeper than {MAX_DEPTH}"),
        (URDF.format("<a>"), "not well-formed"),
        (b"\x00" * 100, "not well-formed"),
        (URDF.format("&unknown;"), "not well-formed"),
    ],
)
def test_a_urdf_that_is_no_plain_xml(tmp_path: Path, content: str | bytes, said: str) -> None:
    site = load_site(sited(tmp_path, content))
    with pytest.raises(GeometryError, match=said) as caught:
        load_arm(site.arm)
    assert str(tmp_path / "slider.urdf") in str(caught.value)
    assert Path("/etc/hostname").read_text().strip() not in str(caught.value)


def test_a_urdf_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = load_site(sited(tmp_path, URDF.format("")))
    monkeypatch.setattr("rampe_guard.collision.urdf_tree.MAX_BYTES", 100)
    (tmp_path / "slider.urdf").write_text(URDF.format("<!-- " + "x" * 100 + " -->"))
    with pytest.raises(GeometryError, match="is larger than"):
        load_arm(site.arm)
    (tmp_path / "slider.urdf").unlink()
    os.mkfifo(tmp_path / "slider.urdf")  # nobody ever writes into it
    with pytest.raises(GeometryError, match="no such URDF file"):
        load_arm(site.arm)
    with pytest.raises(SettingsError, match=r"does not exist|not a regular file"):
        load_site(tmp_path / "site.yaml")


def dae(before: str, inside: str = "") -> str:
    return f'{before}<COLLADA xmlns="x" version="1.4.1">{inside}</COLLADA>'


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.dae", dae(LAUGHS), "has a document type"),
        ("a.dae", dae(OUTSIDE), "has a document type"),
        ("a.dae", dae("", "<a>" * 1000 + "</a>" * 1000), "nested deeper"),
        ("a.gltf", '{"asset": {"version": "2.0"}}', "no triangles"),
        ("a.gltf", "[]", "is no glTF"),
        ("a.gltf", '{"buffers": 7}', "is no glTF"),
        ("a.gltf", "[" * 100_000, "is no glTF"),
        ("a.zip", "PK", "is none of .stl"),
        ("a.npz", "PK", "is none of .stl"),
        ("a.pkl", "cos\nsystem\n(S'touch PWNED'\ntR.", "is none of .stl"),
        ("a.3mf", "PK", "is none of .stl"),
        ("a.step", "ISO", "is none of .stl"),
        ("http:", "", "is none of .stl"),
        ("a", "solid", "is none of .stl"),
    ],
)
def test_a_mesh_file_that_is_more_than_a_mesh(
    tmp_path: Path, name: str, content: str, said: str
) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(GeometryError, match=said):
        load_mesh(tmp_path / name)
    assert {file.name for file in tmp_path.iterdir()} == {name}


def test_a_mesh_opens_no_other_file(tmp_path: Path) -> None:
    cube = trimesh.creation.box()
    (tmp_path / "secret.mtl").write_text("newmtl a\nmap_Kd secret.png\n")
    words = "mtllib secret.mtl\nusemtl a\n"
    (tmp_path / "a.obj").write_text(words + cube.export(file_type="obj"))
    opened = files_opened(lambda: load_mesh(tmp_path / "a.obj"), tmp_path)
    assert opened == {"a.obj"}


@pytest.mark.parametrize("uri", ["secret.bin", "http://127.0.0.1:1/x.bin", "../../etc/passwd"])
def test_a_glb_has_all_of_itself(tmp_path: Path, uri: str) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\0" * 100)
    text = json.dumps(gltf({"byteLength": 36, "uri": uri})).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    (tmp_path / "a.glb").write_bytes(head + text)

    def load() -> None:
        with pytest.raises(GeometryError):
            load_mesh(tmp_path / "a.glb")

    assert files_opened(load, tmp_path) == {"a.glb"}


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "link.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "http://127.0.0.1:1/x.bin",
        "a%00b",
        "gone.bin",
    ],
)
def test_buffers_of_a_gltf_lie_below_its_own_folder(tmp_path: Path, uri: str) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\0" * 36)
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    (folder / "a.gltf").write_text(json.dumps(gltf({"byteLength": 36, "uri": uri})))

    def load() -> None:
        with pytest.raises(GeometryError, match=r"a\.gltf: ") as caught:
            load_mesh(folder / "a.gltf")
        assert Path("/etc/hostname").read_text().strip() not in str(caught.value)

    assert files_opened(load, tmp_path) == {"a.gltf"}


def gltf(buffer: dict[str, object]) -> dict[str, object]:
    """One triangle, its numbers in one buffer."""
    return {
        "asset": {"version": "2.0"},
        "buffers": [buffer],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }


def files_opened(act: Callable[[], object], folder: Path) -> set[str]:
    """Names of all files of a folder that are opened meanwhile."""
    seen: set[str] = set()
    on = True

    def hook(event: str, args: tuple[object, ...]) -> None:
        if on and event == "open" and str(args[0]).startswith(str(folder)):
            seen.add(Path(str(args[0])).name)

    sys.addaudithook(hook)
    act()
    on = False
    return seen


@pytest.mark.parametrize("suffix", FORMATS)
def test_each_of_the_formats_is_read_all_the_same(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"cube{suffix}"
    if suffix == ".dae":
        pytest.importorskip("collada")
    data = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type=suffix[1:])
    if isinstance(data, dict):  # the glTF, and its buffers beside it
        for name, part in data.items():
            (tmp_path / name.replace("model", "cube")).write_bytes(part)
    else:
        file.write_bytes(data.encode() if isinstance(data, str) else data)
    assert np.ptp(load_mesh(file).vertices, axis=0) == pytest.approx([1.0, 2.0, 3.0])


class TestRecordings:
    """A recording comes from anywhere."""

    def test_its_site_reads_no_file_of_this_machine(self, tmp_path: Path) -> None:
        (tmp_path / "secret").mkdir()
        write_stl(tmp_path / "secret" / "far.stl", box_triangles((1, 1, 1)))
        word = tmp_path / "secret" / "word"
        word.write_text("nobody is to read this")
        for number, evil in enumerate((str(word), str(tmp_path / "secret/far.stl"), "../x")):
            folder = tmp_path / f"in-{number}"
            folder.mkdir()
            site = small_site(folder)
            head = head_of(site)
            name = FILES + "site.yaml"
            text = head.attachments[name].replace(b"scene: scene.yaml", f"scene: {evil}".encode())
            files = {**head.attachments, name: text + b"files: {allow: [/]}\n"}
            head = Head(head.metadata, files)
            moves = [entry(site, 0.1, "actuators", {"stamp": 0.1, "position": [0.0]})]
            log = McapReading(write(site, folder / "evil.mcap", [moves], head))
            with (
                pytest.raises(SettingsError, match="outside the site's folder") as caught,
                recorded_site(log),
            ):
                pass
            assert word.read_text() not in str(caught.value)

    def test_nor_does_a_word_that_renames_its_paths(self, tmp_path: Path) -> None:
        site = small_site(tmp_path)
        head = head_of(site)
        renamed = {"absolute": '{"scene.yaml": "../../../etc/hostname"}'}
        words = {**head.metadata[METADATA], **renamed}
        head = Head({METADATA: words}, head.attachments)
        moves = [entry(site, 0.1, "actuators", {"stamp": 0.1, "position": [0.0]})]
        log = McapReading(write(site, tmp_path / "evil.mcap", [moves], head))
        with recorded_site(log) as found:  # the name is no attachment's: it means nothing
            assert Path(found.scene.path).name == "scene.yaml"

    @pytest.mark.parametrize("how", ["zstd", "lz4"])
    def test_a_small_chunk_does_not_unfold_to_any_size(self, how: str) -> None:
        data = bytes(64 * 2**20)
        packed = zstandard.compress(data) if how == "zstd" else lz4.frame.compress(data)
        assert len(packed) < 2**19
        honest = chunk(how, packed, len(data), zlib.crc32(data))
        assert unpacked(honest).data == data
        with pytest.raises(McapError, match="has not the 1000 bytes"):
            unpacked(chunk(how, packed, 1000))
        with pytest.raises(McapError, match="are refused"):
            unpacked(chunk(how, packed, MAX_CHUNK + 1))
        with pytest.raises(McapError, match="compressed by 'brotli'"):
            unpacked(chunk("brotli", packed, 1000))

    def test_a_file_of_such_chunks_is_refused(self, tmp_path: Path) -> None:
        packed = zstandard.compress(bytes(2**20))
        body = struct.pack("<QQQII", 0, 0, 10, 0, 4) + b"zstd" + struct.pack("<Q", len(packed))
        record = struct.pack("<BQ", 6, len(body) + len(packed)) + body + packed
        magic = bytes([137, 77, 67, 65, 80, 48, 13, 10])
        (tmp_path / "bomb.mcap").write_bytes(magic + record)
        with pytest.raises(LogError, match="has not the 10 bytes"):
            McapReading(tmp_path / "bomb.mcap")


def chunk(how: str, data: bytes, size: int, crc: int = 0) -> Chunk:
    return Chunk(
        compression=how,
        data=data,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=crc,
        uncompressed_size=size,
    )
