"""What a site file may make us read: its own folder, and what it allows in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from rampe_guard.collision import load_arm
from rampe_guard.errors import GeometryError, SettingsError
from rampe_guard.recording.bundle import gather
from rampe_guard.settings import Site, load_scene_text, load_site
from tests.support.arms import box_triangles, write_stl

URDF = """<robot name="two"><link name="rail"/>
  <link name="sled"><collision><geometry><mesh filename="{sled}"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="sled"/>
    <axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
</robot>"""
SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard, enabled: r/enabled}
arm:
  urdf: URDF
  actuators: [{name: slide, joint: slide, max_velocity: 1.0}]
scene: SCENE
"""
WALL = "objects: [{name: wall, type: box, size: [1, 1, 1], pose: {xyz: [5, 0, 0]}}]\n"
ROCK = "objects: [{{name: rock, type: mesh, file: {rock}}}]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A site's folder, and beside it another with files that are in order but not its own."""
    for where in (tmp_path / "site", tmp_path / "other"):
        where.mkdir()
        write_stl(where / "cube.stl", box_triangles((0.2, 0.2, 0.2)))
        (where / "arm.urdf").write_text(URDF.format(sled="cube.stl"))
        (where / "scene.yaml").write_text(WALL)
        (where / "zenoh.json5").write_text("{}")
    (tmp_path / "other" / "far.stl").write_bytes((tmp_path / "other" / "cube.stl").read_bytes())
    return tmp_path / "site"


def site(folder: Path, urdf: str = "arm.urdf", scene: str = "scene.yaml", more: str = "") -> Site:
    (folder / "site.yaml").write_text(SITE.replace("URDF", urdf).replace("SCENE", scene) + more)
    return load_site(folder / "site.yaml")


def refusal(folder: Path, urdf: str = "arm.urdf", scene: str = "scene.yaml", more: str = "") -> str:
    with pytest.raises(SettingsError) as caught:
        site(folder, urdf, scene, more)
    return str(caught.value)


def test_files_below_the_site_file_need_no_words(folder: Path) -> None:
    (folder / "deep").mkdir()
    (folder / "deep" / "scene.yaml").write_text(ROCK.format(rock="../cube.stl"))
    assert load_arm(site(folder, scene="deep/scene.yaml").arm).meshes[1] is not None


@pytest.mark.parametrize("how", ["relative", "absolute", "link", "folder"])
def test_a_file_elsewhere_is_refused_however_it_is_named(folder: Path, how: str) -> None:
    other = folder.parent / "other"
    (folder / "link.urdf").symlink_to(other / "arm.urdf")
    (folder / "away").symlink_to(other)
    ways = {
        "relative": "../other/arm.urdf",
        "absolute": str(other / "arm.urdf"),
        "link": "link.urdf",
        "folder": "away/arm.urdf",
    }
    said = refusal(folder, ways[how])
    assert f"site.yaml:5: arm.urdf: {ways[how]!r}"[:60] in said
    assert f"leads to '{other}/arm.urdf', outside the site's folder '{folder}'" in said
    assert said.endswith("write into the site file: files: {allow: ['../other']}")
    site(folder, ways[how], more="files: {allow: ['../other']}\n")  # as it says


def test_scene_and_network_file_obey_the_same_rule(folder: Path) -> None:
    assert "site.yaml:7: scene: '../other/scene.yaml' leads" in refusal(
        folder, "arm.urdf", "../other/scene.yaml"
    )
    said = refusal(folder, more="zenoh: {config: ../other/zenoh.json5}\n")
    assert "site.yaml:8: zenoh.config: '../other/zenoh.json5' leads" in said


def test_what_is_outside_is_not_even_looked_for(folder: Path) -> None:
    there, not_there = refusal(folder, "/etc/passwd"), refusal(folder, "/etc/no-such-file")
    assert there.replace("passwd", "X") == not_there.replace("no-such-file", "X")


def test_a_sibling_whose_name_begins_the_same_is_another_folder(folder: Path) -> None:
    (folder.parent / "site-2").mkdir()
    (folder.parent / "site-2" / "arm.urdf").write_text(URDF.format(sled="cube.stl"))
    assert "outside the site's folder" in refusal(folder, "../site-2/arm.urdf")


def test_a_mesh_of_a_scene(folder: Path) -> None:
    (folder / "scene.yaml").write_text(ROCK.format(rock="../other/cube.stl"))
    said = refusal(folder)
    assert "scene.yaml:1: objects[0].file: '../other/cube.stl' leads to" in said
    assert site(folder, more="files: {allow: [..]}\n").scene.objects[0].name == "rock"


@pytest.mark.parametrize("sled", ["../other/cube.stl", "package://other/far.stl", "file://{}"])
def test_a_mesh_of_a_urdf(folder: Path, sled: str) -> None:
    name = sled.format(folder.parent / "other" / "cube.stl")
    (folder / "arm.urdf").write_text(URDF.format(sled=name))
    found = site(folder)
    with pytest.raises(GeometryError, match=r"outside the site's folder .* files: \{allow"):
        load_arm(found.arm)
    with pytest.raises(GeometryError, match="outside the site's folder"):
        gather(found)  # nor is it copied into a recording
    assert load_arm(site(folder, more="files: {allow: [../other]}\n").arm).meshes[1] is not None


@pytest.mark.parametrize("name", ["a\0b.stl", "loop/cube.stl", "x" * 5000 + ".stl"])
def test_names_that_no_file_can_have(folder: Path, name: str) -> None:
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "arm.urdf").write_text(URDF.format(sled=name))
    with pytest.raises(GeometryError):
        load_arm(site(folder).arm)
    (folder / "arm.urdf").write_text(URDF.format(sled="cube.stl"))
    (folder / "scene.yaml").write_text(ROCK.format(rock=name))
    refusal(folder)


def test_a_site_that_others_wrote_cannot_allow_itself_anything(folder: Path) -> None:
    text = SITE.replace("URDF", "../other/arm.urdf").replace("SCENE", "scene.yaml")
    (folder / "site.yaml").write_text(text + "files: {allow: [/]}\n")
    load_site(folder / "site.yaml")
    with pytest.raises(SettingsError, match="outside the site's folder"):
        load_site(folder / "site.yaml", within=folder)
    load_site(folder / "site.yaml", within=folder.parent)


def test_a_folder_that_leads_in_circles(folder: Path) -> None:
    (folder / "loop").symlink_to(folder / "loop")
    said = refusal(folder, more="files: {allow: [loop/x]}\n")
    assert "site.yaml:8: files.allow: cannot be followed" in said


class TestSceneAsText:
    def test_it_is_read_as_the_sites_own(self, folder: Path) -> None:
        found = site(folder)
        scene = load_scene_text(ROCK.format(rock="cube.stl"), found)
        assert [item.name for item in scene.objects] == ["rock"]
        limit = "objects: [{name: l, type: actuator_limit, actuator: slide, above: 1}]"
        assert load_scene_text(limit.encode(), found).objects[0].name == "l"
        (folder / "scene.yaml").write_text(ROCK.format(rock="cube.stl"))
        again = load_scene_text((folder / "scene.yaml").read_bytes(), found)
        assert again.content_hash == site(folder).scene.content_hash

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            (ROCK.format(rock="../other/cube.stl"), "outside the site's folder"),
            (ROCK.format(rock="/etc/passwd.stl"), "outside the site's folder"),
            ("objects: [{name: a, type: actuator_limit, actuator: arm}]", "not an actuator"),
            (WALL.replace("}}]", "}, key: r/joystick, max_speed: 1}]"), "is keys.joystick already"),
            (WALL.replace("}}]", "}, key: r/enabled, max_speed: 1}]"), "is keys.enabled already"),
            (WALL.replace("}}]", "}, key: r/guard/ack, max_speed: 1}]"), "key of the guard itself"),
            ("objects: []", "at least 1"),
            ("", "objects"),
            ("a: &a [x]\nobjects: [*a, *a]", "anchors are not supported"),
            ("objects: !!python/object/apply:os.system [id]", "tags are not supported"),
            ("objects: " + "[" * 100, "nested deeper than 24"),
            ("#" * 2**20 + "\n", "larger than 1 MB"),
            ("#" * 20_000, "more than 10000 characters"),
            (b"\xff\xfe", "not UTF-8"),
            ("a: \ud800", "not UTF-8"),
        ],
    )
    def test_what_a_file_may_not_say_a_message_may_not(
        self, folder: Path, text: bytes | str, said: str
    ) -> None:
        found = site(folder)
        with pytest.raises(SettingsError, match=said):
            load_scene_text(text, found)

    def test_one_large_file_named_often_is_refused(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        limit = int(2.5 * (folder / "cube.stl").stat().st_size)
        monkeypatch.setattr("rampe_guard.settings.scene.MAX_MESH_BYTES", limit)
        rocks = "".join(f"  - {{name: r{i}, type: mesh, file: cube.stl}}\n" for i in range(3))
        with pytest.raises(SettingsError, match=r"objects\[2\]\.file: with it the meshes are"):
            load_scene_text("objects:\n" + rocks, site(folder))
