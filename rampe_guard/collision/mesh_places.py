"""Where the meshes that a URDF names are: beside it, in folders of packages, never elsewhere.

package://NAME/REST     in each of the site's `package_dirs`, which may be the package itself,
model://NAME/REST       or hold it; then in the folders above the URDF, nearest first
file:///PATH, PATH      as it says, from the URDF's folder

Where there is nothing of a name with %20 and the like, it is looked for without them too: those
who write URDFs take such names for addresses of the web.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import unquote

from rampe_guard.collision.xml_check import read_xml
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.folders import Folders

_PACKAGES: Final = ("package://", "model://")
_MANIFEST: Final = "package.xml"
_MANIFEST_BYTES: Final = 2**20
_MOST_FOLDERS: Final = 2000
"""Of a folder of packages, so many are looked into for their manifests."""


def mesh_file(
    name: str, urdf: Path, folders: Folders | None, package_dirs: tuple[str, ...] = ()
) -> Path:
    """Find a mesh that a URDF names; it need not be there unless it is in a package.

    Args:
        name: as it stands in the URDF.
        urdf: the file.
        folders: in which it must lie; None: anywhere.
        package_dirs: packages, or folders that hold packages, in the order of the search.

    Raises:
        GeometryError: it is not there, or lies outside of ``folders``.
    """
    plain = unquote(name)
    if plain != name and not _is_there(name, urdf, folders, package_dirs):
        name = plain if _is_there(plain, urdf, folders, package_dirs) else name
    try:
        file = _named_file(name, urdf, folders, package_dirs)
        if folders is None or folders.hold(file):
            file.is_file()  # raises where no file can have such a name
            return file
        wrong, remedy = folders.refusal(file)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise GeometryError(f"{urdf}: mesh {name!r} cannot be looked for ({reason})") from None
    raise GeometryError(f"{urdf}: mesh {name!r} {wrong}; {remedy}")


def _is_there(
    name: str, urdf: Path, folders: Folders | None, package_dirs: tuple[str, ...]
) -> bool:
    try:
        return _named_file(name, urdf, folders, package_dirs).is_file()
    except (GeometryError, OSError, ValueError):
        return False


def _named_file(
    name: str, urdf: Path, folders: Folders | None, package_dirs: tuple[str, ...]
) -> Path:
    folder = urdf.resolve().parent
    scheme = next((scheme for scheme in _PACKAGES if name.startswith(scheme)), None)
    if scheme is None:
        path = name.removeprefix("file://")
        if "://" in path:
            raise GeometryError(
                f"{urdf}: mesh {name!r} is not fetched from anywhere; copy it beside the URDF and"
                " name the copy"
            )
        return folder / path
    package, _, rest = name.removeprefix(scheme).partition("/")
    outside = None
    for found in _candidates(package, rest, folder, folders, package_dirs):
        if found.is_file():
            if folders is None or folders.hold(found):
                return found
            outside = outside or found
    if outside is not None:
        return outside  # which its caller refuses, with the folder to allow
    looked = "".join(f" {place}{_shut(place, folders)}," for place in package_dirs)
    raise GeometryError(
        f"{urdf}: mesh {name!r} is not found: package '{package}' was looked for in{looked}"
        f" {folder} and above; write the folder that holds it into the site file, arm:"
        " {package_dirs: [FOLDER]}, and files: {allow: [FOLDER]} (init: --package-dir FOLDER)"
    )


def _shut(place: str, folders: Folders | None) -> str:
    return "" if folders is None or folders.hold(place) else " (which it may not read)"


def manifest_of(name: str, file: Path) -> Path | None:
    """The manifest of the package in which a mesh was found by its name; None if there is none."""
    if not name.startswith(_PACKAGES):
        return None
    for rest in (text.partition("://")[2].partition("/")[2] for text in (name, unquote(name))):
        if file.as_posix().endswith("/" + rest):
            manifest = Path(file.as_posix().removesuffix("/" + rest)) / _MANIFEST
            return manifest if manifest.is_file() else None
    return None


def _candidates(
    package: str, rest: str, folder: Path, folders: Folders | None, package_dirs: tuple[str, ...]
) -> Iterator[Path]:
    for place in map(Path, package_dirs):
        yield place / package / rest
        named = _package_name(place, folders)
        if package == (place.name if named is None else named):
            yield place / rest
        for inner in _inner(place, folders):
            if inner.name != package and _package_name(inner, folders) == package:
                yield inner / rest
    for above in (folder, *folder.parents):
        yield above / package / rest
        yield above / rest


def _inner(place: Path, folders: Folders | None) -> list[Path]:
    """Folders with a manifest in a folder that may be read."""
    if not place.is_dir() or not (folders is None or folders.hold(place)):
        return []
    found = []
    for count, inner in enumerate(sorted(place.iterdir())):
        if count >= _MOST_FOLDERS:
            break
        if (inner / _MANIFEST).is_file():
            found.append(inner)
    return found


def _package_name(place: Path, folders: Folders | None) -> str | None:
    """What the manifest of a package calls it; None without one that can be read."""
    manifest = place / _MANIFEST
    if not manifest.is_file() or not (folders is None or folders.hold(manifest)):
        return None
    with manifest.open("rb") as file:
        content = file.read(_MANIFEST_BYTES + 1)
    if len(content) > _MANIFEST_BYTES:
        return None
    try:
        name = read_xml(content, str(manifest)).find("name")
    except GeometryError:  # somebody else's business
        return None
    return None if name is None else name.text.strip()
