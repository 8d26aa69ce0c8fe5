"""A draft → a scene file with its meshes beside it, checked by the loader before it is there."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rampe_guard.collision.mesh import TriangleMesh
from rampe_guard.core.scene import Scene
from rampe_guard.errors import RampeGuardError, SettingsError
from rampe_guard.folders import Folders
from rampe_guard.scene_tools.draft import Draft, DraftObject, plain
from rampe_guard.scene_tools.scene_text import SceneText
from rampe_guard.settings.problems import show
from rampe_guard.settings.scene_model import MAX_OBJECTS

_FIRST_ITEM: Final = re.compile(r"( *)- ")
_FACE: Final = np.dtype([("count", "u1"), ("corners", "<i4", (3,))])


@dataclass(frozen=True, slots=True)
class Target:
    """Where a draft goes.

    Attributes:
        path: of the scene file.
        before: what it holds already, if objects are added to it; None for a new file.
        folders: where meshes may lie.
    """

    path: Path
    before: SceneText | None
    folders: Folders


def write_scene(draft: Draft, target: Target, *, source: str, margin_m: float) -> Scene:
    """Write, or add to, a scene file.

    Args:
        draft: what to write.
        target: where.
        source: of the draft, for a comment.
        margin_m: of the scene, if the file is new [m].

    Returns:
        The scene as the loader reads it.

    Raises:
        SettingsError: the loader refuses it, or its objects cannot be added to; nothing is changed.
        RampeGuardError: it cannot be written.
    """
    old = () if target.before is None else target.before.scene.objects
    count = len(old) + len(draft.objects)
    if not draft.objects:
        raise SettingsError(f"{source}: has no objects; nothing is written")
    if count > MAX_OBJECTS:
        raise SettingsError(
            f"{target.path}: would have {count} objects, and a scene has at most {MAX_OBJECTS};"
            " import less, or join them into one mesh"
        )
    made: list[Path] = []
    try:
        lines = [_line(item, target.path, made) for item in draft.objects]
        if target.before is None:
            text = _fresh(lines, source, margin_m)
        else:
            text = _added(target.before.text, lines, source)
        scene = SceneText.of(text, target.path, target.folders).scene
        _check_place(scene, [o.name for o in (*old, *draft.objects)], target.path)
        _replace(target.path, text.encode("utf-8"))
    except BaseException as error:
        for file in made:
            with suppress(OSError):
                file.unlink()
                file.parent.rmdir()
        if isinstance(error, OSError):
            raise RampeGuardError(f"{target.path}: cannot be written: {error.strerror}") from None
        raise
    return scene


def _check_place(scene: Scene, names: list[str], path: Path) -> None:
    if [item.name for item in scene.objects] != names:
        raise SettingsError(
            f"{path}: objects cannot be added behind its last one; its 'objects' must be its last"
            " key, with one '- ' per object. Import into a new file, and copy"
        )


def _fresh(lines: Iterable[str], source: str, margin_m: float) -> str:
    head = [
        f"# From {show(source)} by `rampe-guard scene import`.",
        "# Look at it: `rampe-guard scene export` makes a model of it.",
        "frame: world",
        f"margin_m: {plain(margin_m)!r}",
        "objects:",
    ]
    return "\n".join([*head, *(f"  {line}" for line in lines), ""])


def _added(text: str, lines: Iterable[str], source: str) -> str:
    """The text with further objects behind the last."""
    body = text.splitlines()
    start = next((i for i, line in enumerate(body) if line.startswith("objects:")), len(body))
    item = next((m for line in body[start:] if (m := _FIRST_ITEM.match(line))), None)
    indent = "  " if item is None else item.group(1)
    own = [f"{indent}# From {show(source)}", *(indent + line for line in lines)]
    return "\n".join([text.rstrip("\n"), *own, ""])


def _line(item: DraftObject, path: Path, made: list[Path]) -> str:
    """One object on one line, and its mesh in a file."""
    fields: dict[str, Any] = {"name": item.name, **item.fields}
    if item.mesh is not None:
        content = ply(item.mesh)
        slug = re.sub(r"[^A-Za-z0-9._-]+", "-", item.name).strip("-.") or "mesh"
        digest = hashlib.sha256(content).hexdigest()[:8]  # the same mesh is the same file
        file = path.parent / f"{path.stem}-meshes" / f"{slug[:40]}-{digest}.ply"
        if not file.exists():
            file.parent.mkdir(exist_ok=True)
            made.append(file)
            file.write_bytes(content)
        fields["file"] = f"{file.parent.name}/{file.name}"
    return f"- {_flow(fields)}"


def _flow(value: Any) -> str:
    """Plain values as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, str):  # in double quotes JSON is YAML; names are printable
        return value if value in _PLAIN else json.dumps(value, ensure_ascii=False)
    return json.dumps(value)


_PLAIN: Final = {"box", "sphere", "cylinder", "capsule", "halfspace", "mesh"}


def ply(mesh: TriangleMesh) -> bytes:
    """A mesh as binary PLY with all digits of its vertices, which STL would round."""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment metres, z up\n"
        f"element vertex {len(mesh.vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.faces), _FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    return head.encode("ascii") + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()


def _replace(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        mode = path.stat().st_mode if path.exists() else 0o666 & ~_umask()
        Path(name).chmod(mode & 0o777)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
