"""A capsule of a link as triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from rampe_guard.collision.mesh import TriangleMesh, ball_mesh


def capsule_mesh(radius: float, length: float) -> TriangleMesh:
    """Polyhedron round a capsule along z about the origin: it contains the capsule.

    Args:
        radius: of its sides and ends [m].
        length: between the middles of its round ends [m].
    """
    ball = ball_mesh(radius).vertices
    half = np.array([0.0, 0.0, 0.5 * length])
    # what contains the ball contains, drawn along a line, the ball drawn along it
    hull = ConvexHull(np.concatenate([ball - half, ball + half]))
    used, faces = np.unique(hull.simplices, return_inverse=True)
    vertices, faces = hull.points[used], faces.reshape(-1, 3).astype(np.int64)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    inwards = np.einsum("fi,fi->f", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return TriangleMesh(vertices, faces)
