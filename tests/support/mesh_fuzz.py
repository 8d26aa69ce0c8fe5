"""A program that gives FCL and the tree builder every nasty mesh that is let through.

FCL may take the process with it, so this is run as one of its own. The mesh in hand is written
to the file named first, so that whoever finds this process dead can see of what it died.

    python -m tests.support.mesh_fuzz CASE.npz EXAMPLES
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import fcl
import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from rampe_guard.collision.mesh import TriangleMesh, ball_mesh, box_mesh, checked_mesh
from rampe_guard.collision.shape import shape_of
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError

SMALL = (0.0, -0.0, 1.0, 1.0 + 1e-15, 1.0 + 1e-12, -1.0, 0.5, 1e-300, 5e-324, 1e-12, 1e-7, 3.0)
LARGE = (1e3, 9.9e4, 1e5, 1e6, 1e300, np.nan, np.inf, -np.inf)
NUMBERS = st.sampled_from(SMALL + LARGE) | st.floats(-10.0, 10.0)
FINITE = NUMBERS.filter(lambda x: abs(x) <= 1e5)


@st.composite
def soups(draw: st.DrawFn) -> tuple[FloatArray, np.ndarray]:
    """A few vertices, most of them sound, and triangles among them, out of range included."""
    numbers = NUMBERS if draw(st.booleans()) else FINITE
    count = draw(st.integers(1, 12))
    vertices = draw(st.lists(st.tuples(numbers, numbers, numbers), min_size=count, max_size=count))
    last = count if draw(st.integers(0, 9)) == 0 else count - 1
    index = st.integers(0, last)
    faces = draw(st.lists(st.tuples(index, index, index), max_size=40))
    return np.array(vertices, dtype=float), np.array(faces, dtype=np.int64).reshape(-1, 3)


@st.composite
def spoilt(draw: st.DrawFn) -> tuple[FloatArray, np.ndarray]:
    """A sound solid with triangles dropped, doubled, turned, and vertices moved or squashed."""
    mesh = box_mesh(np.ones(3)) if draw(st.booleans()) else ball_mesh(0.5)
    vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    share = draw(st.sampled_from([0.0, 0.02, 0.3, 1.0]))

    def some(n: int) -> np.ndarray:
        return np.flatnonzero(rng.random(n) < share)

    for what in draw(st.lists(st.sampled_from(["drop", "double", "turn", "move", "flat"]))):
        chosen = some(len(faces))
        if what == "drop":
            faces = np.delete(faces, chosen, axis=0)
        elif what == "double":
            faces = np.concatenate([faces, np.roll(faces[chosen], 1, axis=1)])
        elif what == "turn":
            faces[chosen] = faces[chosen][:, ::-1]
        elif what == "move":
            picked = some(len(vertices))
            vertices[picked] = vertices[rng.integers(0, len(vertices), len(picked))]
        else:
            vertices *= rng.choice([1.0, 1e-9, 0.0, 1e3], 3)
    return vertices, faces


def bvh(mesh: TriangleMesh) -> fcl.BVHModel:
    """FCL's mesh."""
    model = fcl.BVHModel()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    return model


def try_out(mesh: TriangleMesh) -> None:
    """Build, collide and measure; answers must be numbers, whatever they are."""
    body = fcl.CollisionObject(bvh(mesh))
    middle = mesh.vertices.mean(axis=0)
    others = [fcl.Box(1.0, 0.3, 0.2), fcl.Sphere(0.4), bvh(mesh), bvh(box_mesh(np.ones(3)))]
    for shape in others:
        for shift in (middle, middle + 0.4, middle + np.array([1e3, 0.0, 0.0])):
            other = fcl.CollisionObject(shape, fcl.Transform(np.eye(3), shift))
            hits = fcl.collide(body, other, fcl.CollisionRequest(num_max_contacts=4))
            far = fcl.distance(body, other, fcl.DistanceRequest())
            assert hits >= 0
            assert not np.isnan(far)
    tree = shape_of(mesh).tree
    assert all(
        np.isfinite(x).all() for x in (tree.vertices, tree.radius, tree.ball, tree.size, tree.inner)
    )
    held = int(tree.triangle_count.sum())
    exact = int(((tree.left < 0) & (tree.triangle_count == 0)).sum())
    assert held == len(tree.corners)
    assert held + 4 * exact <= len(mesh.faces)


def main(case: Path, examples: int) -> None:
    """Try ``examples`` meshes of each kind; print how many were let through."""
    warnings.simplefilter("error")
    let_through = refused = 0

    @seed(4)
    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(soups() | spoilt())
    def run(soup: tuple[FloatArray, np.ndarray]) -> None:
        nonlocal let_through, refused
        try:
            mesh = checked_mesh(*soup, "fuzz")
        except GeometryError:
            refused += 1
            return
        let_through += 1
        np.savez(case, vertices=mesh.vertices, faces=mesh.faces)
        try_out(mesh)

    run()
    print(let_through, refused)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
