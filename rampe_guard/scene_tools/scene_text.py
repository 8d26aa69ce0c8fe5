"""A scene as its file has it: on its own, or of the site that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rampe_guard.core.scene import Scene
from rampe_guard.folders import Folders
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.scene import parse_scene
from rampe_guard.settings.source import parse, read_bytes


@dataclass(frozen=True, slots=True)
class SceneText:
    """A scene, its text, and the actuators that it names, in the order of their first use.

    The index of an actuator limit counts in ``actuators``, not in any site.
    """

    scene: Scene
    text: str
    actuators: tuple[str, ...]

    @classmethod
    def of(cls, text: str, path: Path, folders: Folders) -> SceneText:
        """Read a scene from text as if it stood in ``path``.

        Raises:
            SettingsError: with line, key, value and remedy of every problem.
        """
        data = parse(text, str(path)).data
        items = data.get("objects") if isinstance(data, dict) else None
        named = [
            item.get("actuator")
            for item in (items if isinstance(items, tuple) else ())
            if isinstance(item, dict)
        ]
        actuators = tuple(dict.fromkeys(name for name in named if isinstance(name, str)))
        scene = parse_scene(
            text, actuators=actuators, directory=path.parent, name=str(path), folders=folders
        )
        return cls(scene, text, actuators)

    @classmethod
    def read(cls, path: Path, folders: Folders) -> SceneText:
        """Read a scene file.

        Raises:
            SettingsError: with file, line, key, value and remedy of every problem.
        """
        content = read_bytes(path, "scene file")
        parse(content, str(path))  # says where it is not UTF-8
        return cls.of(content.decode("utf-8-sig"), path, folders)


def read_either(path: str | Path, allowed: tuple[str, ...] = ()) -> tuple[SceneText, Site | None]:
    """The scene of a scene file, or of a site file.

    Args:
        path: either.
        allowed: folders beside the scene file's own in which its meshes may lie; a site file
            names these itself.

    Raises:
        SettingsError: with file, line, key, value and remedy of every problem.
    """
    data = parse(read_bytes(path, "scene file"), str(path)).data
    if isinstance(data, dict) and "objects" not in data and "scene" in data:
        site = load_site(path)
        return SceneText(site.scene, site.scene.text, site.actuator_names), site
    return SceneText.read(Path(path), folders_of(Path(path), allowed)), None


def folders_of(path: Path, allowed: tuple[str, ...]) -> Folders:
    """Where the meshes of a scene file may lie; ``allowed`` as seen from here."""
    return Folders.of(path.parent, tuple(str(Path(folder).absolute()) for folder in allowed))
