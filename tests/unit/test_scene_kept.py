"""The scene that was put outlives the guard, gives way to a newer file, and never goes silently."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.scene_kept import (
    NOT_KEPT,
    UNUSABLE,
    SceneKeeper,
    SceneSource,
)
from rampe_guard.runtime.store import model_folder
from rampe_guard.settings import Site, load_scene_text, load_site
from tests.support.processes import BENCH, ROOT

OTHER = "objects:\n  - {name: fence, type: actuator_limit, actuator: swing, above: 1.2}\n"


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """The bench, its scene beside a copy of its site file."""
    text = BENCH.read_text("utf-8").replace("../../geometry", str(ROOT / "geometry"))
    text = text.replace("../scenes/bench.yaml", "scene.yaml")
    allow = f"files: {{allow: [{ROOT}]}}\n"
    lines = [line for line in text.splitlines() if not line.startswith("files:")]
    (tmp_path / "site.yaml").write_text(allow + "\n".join(lines) + "\n", "utf-8")
    scene = (ROOT / "config" / "scenes" / "bench.yaml").read_text("utf-8")
    (tmp_path / "scene.yaml").write_text(scene, "utf-8")
    made = load_site(tmp_path / "site.yaml")
    return replace(made, memory=replace(made.memory, directory=str(tmp_path / "state")))


def keeper(site: Site) -> SceneKeeper:
    return SceneKeeper(site, Sayer("rampe_guard.test"))


def put(site: Site, text: str = OTHER) -> SceneSource:
    source = SceneSource(load_scene_text(text, site), "ann", 5.0)
    assert keeper(site).keep(source)
    return source


def test_what_was_put_is_there_again(site: Site) -> None:
    assert keeper(site).recall().put_by is None
    source = put(site)
    again = keeper(site)
    found = again.recall()
    assert (found.scene.text, found.put_by, found.put_unix_s) == (OTHER, "ann", 5.0)
    assert found.scene.content_hash == source.scene.content_hash
    assert (again.problem, again.lost) == (None, None)


def test_a_newer_scene_file_wins(site: Site) -> None:
    put(site)
    own = Path(site.scene.path)
    own.write_text(own.read_text("utf-8") + "# edited\n", "utf-8")
    again = load_site(site.path)
    edited = keeper(replace(again, memory=site.memory))
    found = edited.recall()
    assert found.put_by is None
    assert found.scene.content_hash == again.scene.content_hash != site.scene.content_hash
    assert edited.problem is None


@pytest.mark.parametrize("damage", [b"", b"{", b'{"format": "other"}', b"\xff" * 50])
def test_a_damaged_file_is_told_and_the_site_s_own_holds(site: Site, damage: bytes) -> None:
    put(site)
    path = model_folder(site) / "scene.kept.json"
    path.write_bytes(damage)
    damaged = keeper(site)
    assert damaged.recall().put_by is None
    assert damaged.code == UNUSABLE
    assert str(path) in (damaged.problem or "")
    assert damaged.lost
    assert path.read_bytes() == damage  # for whoever looks into it


def test_a_scene_whose_mesh_went_is_told_and_comes_back_with_it(site: Site) -> None:
    mesh = Path(site.path).parent / "rock.stl"
    mesh.write_bytes((ROOT / "geometry" / "scenes" / "yard_terrain.stl").read_bytes())
    text = "objects:\n  - {name: rock, type: mesh, file: rock.stl, open: true}\n"
    put(site, text)
    content = mesh.read_bytes()
    mesh.unlink()
    without = keeper(site)
    assert without.recall().put_by is None
    assert (without.code, "rock.stl" in (without.problem or "")) == (UNUSABLE, True)
    mesh.write_bytes(content)
    assert keeper(site).recall().put_by == "ann"


def test_what_cannot_be_kept_is_told(site: Site) -> None:
    folder = model_folder(site)
    folder.parent.mkdir(parents=True)
    folder.write_text("in the way")
    stuck = keeper(site)
    assert not stuck.keep(SceneSource(load_scene_text(OTHER, site), "ann", 5.0))
    assert (stuck.code, stuck.lost) == (NOT_KEPT, None)
    assert str(folder) in (stuck.problem or "")


def test_without_memory_nothing_is_kept(site: Site) -> None:
    off = replace(site, memory=replace(site.memory, enabled=False))
    assert not keeper(off).keep(SceneSource(load_scene_text(OTHER, off), "ann", 5.0))
    assert keeper(off).recall().put_by is None
    assert not model_folder(site).exists()
