"""Spoilt site, scene, URDF and mesh files through ``rampe-guard check``, in a process of its own.

    python -m tests.support.file_fuzz FOLDER SEED FIRST COUNT

For each file a line says what came of it: its number, its kind, ``ok``, ``refused`` or ``BAD`` and
how long it took [ms]. Refused is what ends with an error of ours; anything else that is raised is
BAD, and told. Native code may take the process with it, so whoever started it goes on behind the
file that was in hand, which stays in FOLDER.
"""

from __future__ import annotations

import io
import logging
import random
import re
import shutil
import struct
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from rampe_guard.collision.mesh import TriangleMesh, ball_mesh, box_mesh
from rampe_guard.errors import RampeGuardError
from rampe_guard.programs.checkup import checkup
from tests.support.bench_site import bench_copy
from tests.support.mutator import Mutator
from tests.support.processes import ROOT

KINDS = ("site", "scene", "urdf", "mesh", "site", "scene", "urdf")
NUMBERS = (
    *("0", "-1", "1e9", "-1e9", "1e308", "1e400", ".nan", ".inf", "nan", "inf", "1e-300", "-0.0"),
    *("1_0", "0x1F", "12:30", "yes", "null", "~", "[]", "{}", "''", "1e5", "100000", "2.5"),
)
YAML = (
    *(
        "&a [*a, *a]",
        "*a",
        "!!python/object/apply:os.system ['true']",
        "!!binary aGk=",
        "<<: {a: 1}",
    ),
    *("---", "...", "%YAML 1.1", "\t", "? x", "- - - - - -", "[" * 2000, "{a: " * 2000, "| \n x"),
    *(
        "\u2028",
        "\ud7ff",
        "\x85",
        "'",
        '"',
        "#",
        "file: /etc/passwd",
        "file: ../../../../etc/passwd",
    ),
    *("files: {allow: [/]}", "extra: 1", "objects: []", "name: ''", "name: wall", "type: mesh"),
)
XML = (
    '<!DOCTYPE r [<!ENTITY a "b"><!ENTITY c "&a;&a;">]>',
    '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
    *(
        "&x;",
        "<![CDATA[",
        "<?xml version='1.0' encoding='utf-16'?>",
        "<link name='base'/>",
        "</robot>",
    ),
    *("<joint name='j' type='fixed'/>", "<mimic joint='swing_joint'/>", "<mesh filename='x.stl'/>"),
    *(
        'filename="package://x/../../../etc/passwd"',
        'filename="http://127.0.0.1:9/x.stl"',
        "<a>" * 3000,
    ),
    *('type="planar"', 'type="floating"', 'xyz="nan 0 0"', 'rpy="1e308 1e308 0"', "\x00", "<!--"),
)
FLOATS = (float("nan"), float("inf"), -float("inf"), 3.4e38, 1e-45, 0.0, -0.0, 1e5, 1e6, -1.0)
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_ROCK = """
  - {name: rock, type: mesh, file: rock.stl, pose: {xyz: [2, 0, 0], rpy: [0, 0, 0]}}
"""
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:e-?\d+)?")


class Spoiler:
    """Spoils one file of a site that is sound otherwise.

    Args:
        folder: of the site; made anew.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(ROOT / "geometry" / "bench", folder / "arm")
        (folder / "arm" / "meshes" / "house.stl").write_bytes(binary_stl(box_mesh(np.full(3, 0.1))))
        scene = folder / "scene.yaml"
        scene.write_text(
            (ROOT / "config" / "scenes" / "bench.yaml").read_text("utf-8") + _ROCK,
            "utf-8",
        )
        (folder / "rock.stl").write_bytes(binary_stl(ball_mesh(0.2)))
        self.site = bench_copy(folder, scene=scene)
        text = self.site.read_text("utf-8").replace(str(ROOT / "geometry" / "bench"), "arm")
        self.site.write_text(text.replace(str(scene), "scene.yaml"), "utf-8")
        self._paths = {
            "site": self.site,
            "scene": scene,
            "urdf": folder / "arm" / "bench.urdf",
            "mesh": folder / "rock.stl",
        }
        self._sound = {kind: path.read_bytes() for kind, path in self._paths.items()}

    def spoil(self, kind: str, rng: random.Random) -> None:
        """Write a spoilt file of a kind."""
        sound = self._sound[kind]
        if kind == "mesh":
            self._mesh(sound, rng)
            return
        text, words = sound, [w.encode() for w in (XML if kind == "urdf" else YAML)]
        for _ in range(rng.choice((1, 1, 1, 2, 3))):
            text = _text(text, words, rng)
        self._paths[kind].write_bytes(text)

    def mend(self, kind: str) -> None:
        """As it was."""
        self._paths[kind].write_bytes(self._sound[kind])
        for path in self._folder.glob("rock.*"):
            if path.suffix != ".stl":
                path.unlink()

    def _mesh(self, sound: bytes, rng: random.Random) -> None:
        """As STL; now and then as text, in place of it."""
        if rng.random() < 0.25:
            text = _obj(sound)
            words = [
                b"f 1 1 1",
                b"f 999999999 1 2",
                b"v nan 0 0",
                b"vn",
                b"mtllib /etc/passwd",
                b"f",
            ]
            for _ in range(rng.randint(1, 3)):
                text = _text(text, words, rng)
            suffix = rng.choice((".obj", ".ply", ".off", ".dae", ".glb"))
            (self._folder / f"rock{suffix}").write_bytes(text)
            scene = self._sound["scene"].replace(b"rock.stl", b"rock" + suffix.encode())
            self._paths["scene"].write_bytes(scene)
            return
        self._paths["scene"].write_bytes(self._sound["scene"])
        self._paths["mesh"].write_bytes(_stl(sound, rng))


def _text(text: bytes, words: list[bytes], rng: random.Random) -> bytes:
    lines = text.split(b"\n")
    at = rng.randrange(len(lines))

    def number() -> bytes:
        found = list(_NUMBER.finditer(text))
        if not found:
            return text
        where = rng.choice(found)
        return text[: where.start()] + rng.choice(NUMBERS).encode() + text[where.end() :]

    def swapped() -> bytes:
        other = rng.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
        return b"\n".join(lines)

    def inserted() -> bytes:
        line = lines[at]
        indent = line[: len(line) - len(line.lstrip())]
        return b"\n".join([*lines[:at], indent + rng.choice(words), *lines[at:]])

    ways: tuple[Callable[[], bytes], ...] = (
        number,
        number,
        number,
        swapped,
        inserted,
        lambda: b"\n".join(lines[:at] + lines[at + 1 :]),
        lambda: b"\n".join([*lines[: at + 1], lines[at], *lines[at + 1 :]]),
        lambda: b"\n".join([*lines[:at], b" " * rng.randint(1, 5) + lines[at], *lines[at + 1 :]]),
        lambda: lines[at].join(text.split(rng.choice(lines) or b"\n", 1)),
        lambda: Mutator(rng, [text]).spoil_bytes(text),
    )
    return rng.choice(ways)()


def _stl(sound: bytes, rng: random.Random) -> bytes:
    spoilt = bytearray(sound)
    count = (len(sound) - 84) // 50
    for _ in range(rng.randint(1, 4)):
        way = rng.randrange(6)
        if way == 0:  # a number
            at = 84 + 50 * rng.randrange(count) + 4 * rng.randrange(12)
            spoilt[at : at + 4] = struct.pack("<f", rng.choice(FLOATS))
        elif way == 1:  # how many there are
            told = rng.choice((0, 1, count - 1, count + 1, 2**31, 2**32 - 1))
            spoilt[80:84] = struct.pack("<I", told)
        elif way == 2:
            del spoilt[rng.randrange(84, len(spoilt)) :]
            spoilt += bytes(max(0, 84 + 50 - len(spoilt)))
        elif way == 3:  # a triangle in the place of another
            a, b = (84 + 50 * rng.randrange(count) for _ in range(2))
            spoilt[a : a + 50] = sound[b : b + 50]
        elif way == 4:
            spoilt[:6] = b"solid "
        else:
            for _ in range(rng.randint(1, 30)):
                spoilt[rng.randrange(len(spoilt))] ^= 1 << rng.randrange(8)
        spoilt += sound[len(spoilt) :] if rng.random() < 0.5 else b""
        if len(spoilt) < len(sound):
            break
    return bytes(spoilt)


def binary_stl(mesh: TriangleMesh) -> bytes:
    """As a file."""
    corners = mesh.vertices[mesh.faces].astype("<f4").reshape(-1, 9)
    rows = [bytes(12) + row.tobytes() + bytes(2) for row in corners]
    return bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def _obj(stl: bytes) -> bytes:
    """The same as text of another format."""
    corners = np.frombuffer(stl[84:], dtype=_TRIANGLE)["corners"]
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in corners.reshape(-1, 3)]
    lines += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(corners))]
    return "\n".join(lines).encode()


def main() -> None:
    folder, seed, first, count = Path(sys.argv[1]), *map(int, sys.argv[2:5])
    logging.getLogger("rampe_guard").addHandler(logging.NullHandler())
    warnings.simplefilter("ignore")  # of numpy, of numbers that are refused in the end
    spoiler = Spoiler(folder)
    for number in range(first, first + count):
        rng = random.Random(seed * 1_000_003 + number)
        kind = KINDS[number % len(KINDS)]
        spoiler.spoil(kind, rng)
        began_s = time.perf_counter()
        try:
            checkup(str(spoiler.site), Console(file=io.StringIO(), width=100))
            outcome = "ok"
        except RampeGuardError as error:
            outcome = "refused" if str(error).strip() else "BAD"
        except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
            traceback.print_exc()
            outcome = "BAD"
        took_ms = (time.perf_counter() - began_s) * 1e3
        print(number, kind, outcome, f"{took_ms:.1f}", flush=True)
        if outcome == "BAD":
            shutil.copytree(folder, folder.parent / f"bad-{number}", dirs_exist_ok=True)
        spoiler.mend(kind)
        if kind == "mesh":
            spoiler.mend("scene")


if __name__ == "__main__":
    main()
