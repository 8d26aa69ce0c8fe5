"""The shapes of a URDF's links as checked meshes, in the link's frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.collision.capsule_mesh import capsule_mesh
from rampe_guard.collision.mesh import (
    LINK_MOST_M,
    TriangleMesh,
    ball_mesh,
    box_mesh,
    check_extent,
    checked_mesh,
    load_mesh,
    open_words,
    prism_mesh,
)
from rampe_guard.collision.mesh_places import mesh_file
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.collision.urdf_model import Geometry, Link, Mesh
    from rampe_guard.folders import Folders


@dataclass(frozen=True, slots=True)
class LinkReader:
    """Reads the shapes of one URDF's links.

    Attributes:
        urdf: the file.
        folders: in which meshes must lie; None: anywhere.
        package_dirs: in which packages are looked for.
    """

    urdf: Path
    folders: Folders | None
    package_dirs: tuple[str, ...] = ()

    def mesh(self, link: Link) -> TriangleMesh | None:
        """All shapes of a link as one mesh; None if it has none.

        Raises:
            GeometryError: naming the link or the mesh file, and what is wrong.
        """
        name = f"{self.urdf}: link '{link.name}'"
        parts = []
        for shape in link.shapes:
            origin = np.eye(4) if shape.origin is None else np.asarray(shape.origin, dtype=float)
            if not np.isfinite(origin).all():
                raise GeometryError(f"{name}: its origin is not finite")
            parts.append(self._shape(shape.geometry, name).moved(origin))
        if not parts:
            return None
        offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        faces = np.concatenate([p.faces + o for p, o in zip(parts, offsets, strict=True)])
        vertices = np.concatenate([part.vertices for part in parts])
        notes = [note for part in parts for note in part.notes]
        mesh = checked_mesh(vertices, faces, name, notes=notes)
        return replace(mesh, notes=(*mesh.notes, *open_words(mesh, name)))

    def _shape(self, geometry: Geometry, where: str) -> TriangleMesh:
        if geometry.mesh is not None:
            return self._file(geometry.mesh, where)
        if geometry.box is not None:
            return box_mesh(np.array(geometry.box.size))
        if geometry.sphere is not None:
            return ball_mesh(geometry.sphere.radius)
        rod = geometry.cylinder or geometry.capsule
        if rod is not None:
            make = prism_mesh if geometry.cylinder else capsule_mesh
            return make(rod.radius, rod.length)
        raise GeometryError(
            f"{where}: a shape <{geometry.tag}>; use mesh, box, cylinder, capsule or sphere"
        )

    def _file(self, mesh: Mesh, where: str) -> TriangleMesh:
        file = mesh_file(mesh.filename, self.urdf, self.folders, self.package_dirs)
        scale = np.ones(3) if mesh.scale is None else np.array(mesh.scale)
        read = load_mesh(file, scale)
        extent = float(np.ptp(read.vertices, axis=0).max())
        said = check_extent(extent, f"{where}: {file}", LINK_MOST_M)
        return replace(read, notes=(*read.notes, *said))
