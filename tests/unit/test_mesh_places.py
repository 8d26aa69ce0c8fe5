"""Packages that a URDF names are found by the site's list, and nowhere that it does not allow."""

from __future__ import annotations

from pathlib import Path

import pytest

from rampe_guard.collision import load_arm
from rampe_guard.collision.mesh_places import mesh_file
from rampe_guard.errors import GeometryError
from rampe_guard.folders import Folders
from rampe_guard.recording.bundle import gather, unpack
from rampe_guard.settings import load_site
from tests.support.arms import box_triangles, write_stl

NAME = "package://my_arm/meshes/b.stl"
URDF = f"""<robot name="two"><link name="rail"/>
  <link name="sled"><collision><geometry><mesh filename="{NAME}"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="sled"/>
    <axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
</robot>"""
SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard, enabled: r/enabled}
arm:
  urdf: arm.urdf
  package_dirs: [DIRS]
  actuators: [{name: slide, joint: slide, max_velocity: 1.0}]
scene: scene.yaml
files: {allow: [ALLOW]}
"""
WALL = "objects: [{name: wall, type: box, size: [1, 1, 1], pose: {xyz: [5, 0, 0]}}]\n"


def package(folder: Path, called: str | None = "my_arm", size: float = 1.0) -> Path:
    """A package with one mesh, and a manifest if it is called something."""
    (folder / "meshes").mkdir(parents=True)
    if called is not None:
        (folder / "package.xml").write_text(f"<package><name> {called}\n</name></package>")
    return write_stl(folder / "meshes" / "b.stl", box_triangles((size, size, size)))


@pytest.mark.parametrize(
    ("place", "called", "given"),
    [
        ("share/my_arm", None, "share"),
        ("share/my_arm", None, "share/my_arm"),
        ("clone-of-it", "my_arm", "clone-of-it"),
        ("src/clone-of-it", "my_arm", "src"),
    ],
)
@pytest.mark.parametrize("scheme", ["package", "model"])
def test_a_folder_of_the_list_is_the_package_or_holds_it(
    tmp_path: Path, place: str, called: str | None, given: str, scheme: str
) -> None:
    mesh = package(tmp_path / "ros" / place, called)
    urdf = tmp_path / "site" / "arm.urdf"
    name = NAME.replace("package", scheme)
    dirs = (str(tmp_path / "empty"), str(tmp_path / "ros" / given))
    assert mesh_file(name, urdf, None, dirs) == mesh


def test_a_manifest_says_better_than_a_folder_what_a_package_is(tmp_path: Path) -> None:
    package(tmp_path / "ros" / "my_arm", "another_arm")
    with pytest.raises(GeometryError, match="package 'my_arm' was looked for in"):
        mesh_file(NAME, tmp_path / "arm.urdf", None, (str(tmp_path / "ros" / "my_arm"),))


def test_the_list_comes_before_what_is_above_the_urdf(tmp_path: Path) -> None:
    near = package(tmp_path / "site" / "my_arm", None)
    far = package(tmp_path / "ros" / "my_arm", None)
    urdf = tmp_path / "site" / "urdf" / "arm.urdf"
    assert mesh_file(NAME, urdf, None) == near
    assert mesh_file(NAME, urdf, None, (str(tmp_path / "ros"),)) == far
    # what the site does not allow is passed by where there is another, and refused where not
    held = Folders((str(tmp_path / "site"),))
    assert mesh_file(NAME, urdf, held, (str(tmp_path / "ros"),)) == near
    (near.parent / "b.stl").unlink()
    with pytest.raises(GeometryError, match=r"outside the site's folder.*allow: \['\.\./ros"):
        mesh_file(NAME, urdf, held, (str(tmp_path / "ros"),))


def test_a_package_found_nowhere_is_named_with_where_it_was_looked_for(tmp_path: Path) -> None:
    with pytest.raises(GeometryError) as caught:
        mesh_file(NAME, tmp_path / "arm.urdf", None, (str(tmp_path / "ros"),))
    said = str(caught.value)
    assert f"{tmp_path}/arm.urdf: mesh '{NAME}' is not found: package 'my_arm'" in said
    assert f"looked for in {tmp_path}/ros, {tmp_path} and above" in said
    assert "package_dirs: [FOLDER]" in said


@pytest.mark.parametrize("name", ["http://host/b.stl", "fuel://a/b.stl"])
def test_nothing_is_fetched(tmp_path: Path, name: str) -> None:
    with pytest.raises(GeometryError, match="is not fetched from anywhere"):
        mesh_file(name, tmp_path / "arm.urdf", None)


def site(folder: Path, dirs: str, allow: str) -> Path:
    (folder / "site.yaml").write_text(SITE.replace("DIRS", dirs).replace("ALLOW", allow))
    (folder / "scene.yaml").write_text(WALL)
    (folder / "arm.urdf").write_text(URDF)
    return folder / "site.yaml"


def test_a_site_names_its_packages_and_a_recording_takes_them_along(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    package(tmp_path / "ros" / "src" / "clone", size=0.5)
    path = site(tmp_path / "site", "../ros/src", "../ros")
    loaded = load_site(path)
    assert load_arm(loaded.arm).meshes[1] is not None
    with pytest.raises(GeometryError, match=r"in .*/ros/src/clone \(which it may not read\)"):
        load_arm(load_site(site(tmp_path / "site", "../ros/src/clone", "../elsewhere")).arm)
    copy = tmp_path / "copy"
    site(tmp_path / "site", "../ros/src/clone", "../ros")
    bundle = gather(load_site(path))
    assert any(name.endswith("clone/meshes/b.stl") for name in bundle.files)
    again = load_site(unpack(bundle, copy), within=copy)
    assert load_arm(again.arm).meshes[1] is not None


@pytest.mark.parametrize("name", ["parts/Ausleger 1.stl", "parts/Ausleger%201.stl"])
@pytest.mark.parametrize("scheme", ["", "file://{}/", "package://site/"])
def test_a_name_may_be_written_as_on_the_web(tmp_path: Path, name: str, scheme: str) -> None:
    folder = tmp_path / "site"
    (folder / "parts").mkdir(parents=True)
    mesh = write_stl(folder / "parts" / "Ausleger 1.stl", box_triangles((1, 1, 1)))
    found = mesh_file(scheme.format(folder) + name, folder / "arm.urdf", Folders.of(folder))
    assert found == mesh
    odd = write_stl(folder / "parts" / "Ausleger%201.stl", box_triangles((1, 1, 1)))
    literal = mesh_file(scheme.format(folder) + name, folder / "arm.urdf", Folders.of(folder))
    assert literal == (odd if "%" in name else mesh)


@pytest.mark.parametrize("name", ["%2e%2e/secret.stl", "a%00.stl"])
def test_a_name_of_the_web_leads_nowhere_else(tmp_path: Path, name: str) -> None:
    (tmp_path / "site").mkdir()
    write_stl(tmp_path / "secret.stl", box_triangles((1, 1, 1)))
    try:
        file = mesh_file(name, tmp_path / "site" / "arm.urdf", Folders.of(tmp_path / "site"))
    except GeometryError:
        return
    assert not file.exists()


def test_a_recording_takes_along_what_is_named_as_on_the_web(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    write_stl(tmp_path / "site" / "b 1.stl", box_triangles((1, 1, 1)))
    path = site(tmp_path / "site", ".", ".")
    (tmp_path / "site" / "arm.urdf").write_text(URDF.replace(NAME, "b%201.stl"))
    again = load_site(unpack(gather(load_site(path)), tmp_path / "copy"), within=tmp_path / "copy")
    assert load_arm(again.arm).meshes[1] is not None
