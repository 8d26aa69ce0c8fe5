"""The files that a site is made of, as attachments: a recording replays where none of them is.

Attachments are named by their places below the folder that holds all of them, so that the
relative paths in them stay true wherever they are put. Absolute paths are noted, and written
anew in the copy. Zenoh's own file, certificates and keys are left out, empty ones stand for them:
they may hold secrets, and no replay needs them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from rampe_guard.collision.mesh_gltf import companions
from rampe_guard.collision.mesh_places import manifest_of
from rampe_guard.collision.urdf import mesh_file, read_urdf
from rampe_guard.core.scene import Mesh
from rampe_guard.errors import LogError
from rampe_guard.settings import Site
from rampe_guard.settings.source import MAX_MESH_BYTES, parse, read_bytes

_TEXTS: Final = (".yaml", ".yml", ".urdf", ".xml")
"""Files that name others."""


@dataclass(frozen=True, slots=True)
class Bundle:
    """Files by their names, which are relative and in the manner of POSIX.

    Attributes:
        site: name of the site file among them.
        files: content of each.
        absolute: absolute paths that stand in some of them, and the file that each means.
    """

    site: str
    files: Mapping[str, bytes]
    absolute: Mapping[str, str]


def gather(site: Site) -> Bundle:
    """All files of a site: its own, URDF, and meshes, and the scene as the site has it.

    Raises:
        SettingsError: one cannot be read.
        GeometryError: the URDF cannot be read, or a mesh is not where it says.
    """
    places = dict(_places(site))
    root = Path(os.path.commonpath([place.parent for place in places]))
    names = {place: place.relative_to(root).as_posix() for place in places}
    files = {
        names[place]: b"{}\n"
        if source is None
        else read_bytes(source, "file", limit=MAX_MESH_BYTES)
        for place, source in places.items()
    }
    # not what stands in its file by now: a guard may have been given another one
    files[names[_absolute(site.scene.path)]] = site.scene.text.encode()
    absolute = {
        written: names[place]
        for written, place in _written(site)
        if Path(written.removeprefix("file://")).is_absolute()
    }
    return Bundle(names[_absolute(site.path)], files, absolute)


def unpack(bundle: Bundle, folder: Path) -> Path:
    """Write all files below ``folder``, and nothing beside it; returns the site file's path.

    Raises:
        LogError: a name leads out of the folder, or the site file is not among them.
    """
    places = {name: folder.joinpath(*_safe(name).parts) for name in bundle.files}
    if bundle.site not in places:
        raise LogError(f"there is no site file {bundle.site!a} among the attachments")
    meant = {
        written.encode(): os.fsencode(places[name])
        for written, name in bundle.absolute.items()
        if name in places
    }
    try:
        for name, content in bundle.files.items():
            place = places[name]
            place.parent.mkdir(parents=True, exist_ok=True)
            with place.open("xb") as file:  # never through a link, nor twice
                file.write(_renamed(name, content, meant))
    except OSError as error:
        raise LogError(f"attachments cannot be put into {folder}: {error.strerror}") from None
    return places[bundle.site]


def _safe(name: str) -> PurePosixPath:
    path = PurePosixPath(name)
    odd = any(part in {"", ".", ".."} for part in name.split("/"))
    if odd or path.is_absolute() or "\\" in name or "\0" in name or ":" in path.parts[0]:
        raise LogError(
            f"attachment {ascii(name)[:200]} would lie outside its folder; it is refused"
        )
    return path


def _renamed(name: str, content: bytes, meant: Mapping[bytes, bytes]) -> bytes:
    if name.endswith(_TEXTS):
        for written in sorted(meant, key=len, reverse=True):  # one may begin another
            content = content.replace(written, meant[written])
    return content


def _places(site: Site) -> Iterator[tuple[Path, str | None]]:
    """Where each file is as its referrer sees it, and what to read; None: nothing from there."""
    yield _absolute(site.path), site.path
    yield _absolute(site.scene.path), None
    yield _absolute(site.arm.urdf), site.arm.urdf
    for _, file in _of_the_network(site):
        yield _absolute(file), None
    for item in site.scene.objects:
        if isinstance(item, Mesh):
            yield from _mesh(_absolute(item.file), Path(item.file))
    for name, place, found in _urdf_meshes(site):
        yield from _mesh(place, found)
        manifest = manifest_of(name, found)
        if manifest is not None:  # by which the package is found under its name
            yield _beside(place, found, manifest), str(manifest)


def _mesh(place: Path, file: Path) -> Iterator[tuple[Path, str]]:
    """A mesh, and the files beside it that it needs."""
    yield place, str(file)
    for part in companions(file):
        yield _beside(place, file, part), str(part)


def _beside(place: Path, file: Path, other: Path) -> Path:
    """Where another file is for whom ``file`` is at ``place``."""
    return _absolute(place.parent / os.path.relpath(other, file.parent))


def _written(site: Site) -> Iterator[tuple[str, Path]]:
    """References as they stand in the files, and which place each means."""
    document = parse(read_bytes(site.path, "site file"), site.path).data
    yield document["arm"]["urdf"], _absolute(site.arm.urdf)
    yield document["scene"], _absolute(site.scene.path)
    for path, file in _of_the_network(site):
        written = document["zenoh"]
        for key in path:
            written = written[key]
        yield written, _absolute(file)
    scene = parse(site.scene.text, site.scene.path).data
    files = {item["name"]: item["file"] for item in scene["objects"] if "file" in item}
    for item in site.scene.objects:
        if isinstance(item, Mesh):
            yield files[item.name], _absolute(item.file)
    for reference, place, _ in _urdf_meshes(site):
        yield reference, place


def _of_the_network(site: Site) -> Iterator[tuple[tuple[str, ...], str]]:
    """Where each file stands below ``zenoh``, and the file: what may hold secrets."""
    if site.zenoh.config is not None:
        yield ("config",), site.zenoh.config
    if (tls := site.zenoh.tls) is not None:
        for name in ("root_ca", "certificate", "key"):
            if (file := getattr(tls, name)) is not None:
                yield ("tls", name), file


def _urdf_meshes(site: Site) -> list[tuple[str, Path, Path]]:
    """Per mesh: how the URDF names it, where that is seen from the URDF, and the file."""
    found = []
    urdf = site.arm.urdf
    folder, here = _absolute(urdf).parent, Path(urdf).resolve().parent
    for link in read_urdf(Path(urdf)).links:
        for shape in link.shapes:
            if shape.geometry.mesh is None:
                continue
            reference = shape.geometry.mesh.filename
            file = mesh_file(reference, Path(urdf), site.folders, site.package_dirs)
            place = file
            if not Path(reference.removeprefix("file://")).is_absolute():
                place = folder / os.path.relpath(file, here)  # the URDF itself may be a link
            found.append((reference, _absolute(place), file))
    return found


def _absolute(path: str | Path) -> Path:
    return Path(os.path.normpath(Path(path).absolute()))
