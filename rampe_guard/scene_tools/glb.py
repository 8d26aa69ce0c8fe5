"""A scene, and perhaps the arm, as a glTF model that any viewer shows.

Bodies are opaque, margins translucent, colours go by kind. Names are kept: of a body that of its
zone, ``NAME margin`` of its shell, ``arm LINK`` of a link. glTF's y axis points up, so a root node
``world`` turns our z to it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from rampe_guard.collision.mesh_topology import IntArray
from rampe_guard.core.types import FloatArray

ROOT: Final = "world"
MARGIN: Final = " margin"
ARM: Final = "arm "
_TURN: Final = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
_COLOURS: Final = {
    "box": (214, 122, 58),
    "sphere": (186, 85, 160),
    "cylinder": (222, 178, 60),
    "capsule": (200, 60, 60),
    "halfspace": (128, 140, 150),
    "mesh": (110, 150, 90),
    "arm": (90, 130, 200),
}
_SHELL: Final = 60
_WIDE: Final = 120
"""Opacity of a margin, and of a halfspace, of 255."""


@dataclass(frozen=True, slots=True)
class Part:
    """One thing to draw.

    Attributes:
        name: of its node; unique.
        kind: word for its colour.
        vertices: (v, 3) in the world [m].
        faces: (f, 3).
        is_margin: it is seen through.
    """

    name: str
    kind: str
    vertices: FloatArray
    faces: IntArray
    is_margin: bool = False


def glb(parts: Iterable[Part]) -> bytes:
    """A binary glTF file of all parts."""
    scene = trimesh.Scene(base_frame=ROOT)
    up = "z up"
    scene.graph.update(frame_from=ROOT, frame_to=up, matrix=_TURN)
    for part in parts:
        opacity = _SHELL if part.is_margin else _WIDE if part.kind == "halfspace" else 255
        material = PBRMaterial(
            name=f"{part.kind}{MARGIN if part.is_margin else ''}",
            baseColorFactor=[*_COLOURS[part.kind], opacity],
            alphaMode="OPAQUE" if opacity == 255 else "BLEND",  # noqa: PLR2004 - all of it
            metallicFactor=0.1,
            roughnessFactor=0.8,
            doubleSided=part.is_margin,
        )
        mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(mesh, node_name=part.name, geom_name=part.name, parent_node_name=up)
    return bytes(scene.export(file_type="glb"))
