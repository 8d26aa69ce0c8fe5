"""The files of a site as attachments: complete, true elsewhere, and never beside their folder."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rampe_guard.collision import load_arm
from rampe_guard.errors import GeometryError, LogError, SettingsError
from rampe_guard.recording.bundle import Bundle, gather, unpack
from rampe_guard.resources import shipped_site
from rampe_guard.settings import load_site
from tests.support.arms import box_triangles, write_stl
from tests.support.recording_files import SITE

URDF = """<robot name="two">
  <link name="rail"><visual><geometry><mesh filename="package://two/rail.stl"/></geometry></visual>
  </link>
  <link name="sled"><collision><geometry><mesh filename="{sled}"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="sled"/>
    <axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
</robot>"""
SCENE = "objects: [{{name: rock, type: mesh, file: {rock}}}]\n"


def layout(folder: Path, *, absolute: bool) -> Path:
    """A site whose files lie apart: by relative paths, by absolute ones, by package://."""
    for name in ("sites", "two/urdf", "far/meshes", "rocks"):
        (folder / name).mkdir(parents=True)
    cube = box_triangles((0.2, 0.2, 0.2))
    sled = write_stl(folder / "far/meshes/sled.stl", cube)
    rock = write_stl(folder / "rocks/rock.stl", box_triangles((0.2, 0.2, 0.2), (3, 0, 0)))
    write_stl(folder / "two/rail.stl", cube)
    urdf = folder / "two/urdf/two.urdf"
    urdf.write_text(URDF.format(sled=f"file://{sled}" if absolute else "../../far/meshes/sled.stl"))
    scene = folder / "sites/scene.yaml"
    scene.write_text(SCENE.format(rock=rock if absolute else "../rocks/rock.stl"))
    text = SITE.replace("slider.urdf", str(urdf) if absolute else "../two/urdf/two.urdf")
    text = text.replace("scene: scene.yaml", f"scene: {scene}" if absolute else "scene: scene.yaml")
    (folder / "sites/zenoh.json5").write_text('{"transport": {"auth": {"password": "hush"}}}')
    text += "zenoh: {config: zenoh.json5}\nfiles: {allow: [..]}\n"
    site = folder / "sites/site.yaml"
    site.write_text(text)
    return site


@pytest.mark.parametrize("absolute", [False, True], ids=["relative", "absolute"])
def test_a_site_is_the_same_where_its_files_are_gone(tmp_path: Path, *, absolute: bool) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    site = load_site(layout(here, absolute=absolute))
    bundle = gather(site)
    assert set(bundle.files) == {
        *("sites/site.yaml", "sites/scene.yaml", "sites/zenoh.json5", "two/urdf/two.urdf"),
        *("two/rail.stl", "far/meshes/sled.stl", "rocks/rock.stl"),
    }
    assert b"hush" not in b"".join(bundle.files.values())
    before = [m and m.vertices.tolist() for m in load_arm(site.arm).meshes]
    shutil.rmtree(here)

    copy = load_site(unpack(bundle, there))
    assert copy.path == str(there / "sites/site.yaml")
    assert [m and m.vertices.tolist() for m in load_arm(copy.arm).meshes] == before
    assert gather(copy).files.keys() == bundle.files.keys()
    assert (copy.guard, copy.keys) == (site.guard, site.keys)
    if not absolute:
        assert copy.content_hash == site.content_hash
        assert copy.scene.content_hash == site.scene.content_hash


@pytest.mark.parametrize("name", ["demo", "bench"])
def test_shipped_sites_need_nothing_else(name: str, tmp_path: Path) -> None:
    site = load_site(shipped_site(name))
    bundle = gather(site)
    assert bundle.absolute == {}
    assert gather(load_site(unpack(bundle, tmp_path))) == bundle


def test_a_urdf_behind_a_link_keeps_its_meshes(tmp_path: Path) -> None:
    layout(tmp_path / "here", absolute=False)
    (tmp_path / "here/sites/arm").symlink_to(tmp_path / "here/two/urdf")
    site = tmp_path / "here/sites/site.yaml"
    site.write_text(site.read_text().replace("../two/urdf/two.urdf", "arm/two.urdf"))
    bundle = gather(load_site(site))
    shutil.rmtree(tmp_path / "here")
    copy = load_site(unpack(bundle, tmp_path / "deeper/there"))
    assert sum(mesh is not None for mesh in load_arm(copy.arm).meshes) == 2


@pytest.mark.parametrize(
    "name",
    [
        *("../evil", "a/../../evil", "/evil", "a//b", "", ".", "a/..", "a/./b", "a\\..\\b"),
        *("C:/evil", "a\0b"),
    ],
)
def test_an_attachment_that_would_leave_its_folder_is_refused(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    with pytest.raises(LogError, match="refused"):
        unpack(Bundle("s.yaml", {"s.yaml": b"", name: b"evil"}, {}), folder)
    assert list(tmp_path.rglob("*")) == [folder]  # nothing at all was written


def test_names_that_meet_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="attachments cannot be put"):
        unpack(Bundle("a", {"a": b"", "a/b": b""}, {}), tmp_path / "x")
    with pytest.raises(LogError, match=r"no site file 's\.yaml'"):
        unpack(Bundle("s.yaml", {"a": b""}, {}), tmp_path / "y")


def test_a_mesh_that_is_not_there_is_told(tmp_path: Path) -> None:
    site = load_site(layout(tmp_path, absolute=False))
    (tmp_path / "far/meshes/sled.stl").unlink()
    with pytest.raises((GeometryError, SettingsError), match=r"sled\.stl"):
        gather(site)
