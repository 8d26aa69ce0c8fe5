"""A picture of an arm among its zones, from three sides: at rest, and where its limits take it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from rampe_guard.assembly import Machine
from rampe_guard.collision.mesh import ball_mesh, box_mesh, load_mesh, prism_mesh
from rampe_guard.core.kinematics import apply
from rampe_guard.core.scene import (
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    Mesh,
    SolidObject,
    Sphere,
)
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import RampeGuardError
from rampe_guard.evaluate.extra import missing
from rampe_guard.programs.checkup_reach import span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_VIEWS = (("from above", 0, 1), ("from the right", 0, 2), ("from the front", 1, 2))
"""Names, and the axes of the world to the right and up."""
_MOST_TRIANGLES = 6000
_ROUND = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
_ARM, _ZONE, _MARGIN = "#30475e", "#c0392b", "#e59866"
_EDGE = 0.999
_FAR = 1.5
"""Half of the picture's width, in reaches of the arm."""


def draw(machine: Machine, rest: FloatArray, path: str) -> None:
    """Write the picture.

    Args:
        machine: loaded.
        rest: actuator values (n,) of the arm that is drawn in full.
        path: PNG, or another kind that matplotlib knows by its ending.

    Raises:
        RampeGuardError: matplotlib is not there, or the file cannot be written.
    """
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise missing(error) from None
    figure = Figure(figsize=(18, 6.6), layout="constrained")
    low, high = span(machine)
    centre, half = _frame(machine, low, high, rest)
    for place, (name, right, up) in enumerate(_VIEWS):
        axes = figure.add_subplot(1, 3, place + 1)
        window = (centre[right], centre[up], half)
        for zone in machine.site.scene.objects:
            if not isinstance(zone, ActuatorLimit):
                _zone(axes, zone, (right, up), window)
        for posture in _at_limits(low, high, rest):
            _arm(axes, machine, posture, (right, up), faint=True)
        _arm(axes, machine, rest, (right, up), faint=False)
        axes.set_title(name)
        axes.set_aspect("equal")
        axes.set_xlim(window[0] - half, window[0] + half)
        axes.set_ylim(window[1] - half, window[1] + half)
        axes.set_xlabel(f"{'xyz'[right]} [m]")
        axes.set_ylabel(f"{'xyz'[up]} [m]")
        axes.grid(visible=True, alpha=0.25)
    site = machine.site
    figure.suptitle(
        f"{site.machine} at {site.name}: dark: middle of all travels; pale: each actuator at its"
        " limits; red: zones, dashed: their margins (of a mesh: of its hull)"
    )
    try:
        figure.savefig(path, dpi=100)
    except (OSError, ValueError) as error:  # ValueError: an ending that it does not know
        raise RampeGuardError(f"{path}: the picture cannot be written: {error}") from None


def _at_limits(low: FloatArray, high: FloatArray, rest: FloatArray) -> Iterator[FloatArray]:
    for j in range(len(rest)):
        for end in (low[j], high[j]):
            posture = rest.copy()
            posture[j] = end
            yield posture


def _frame(
    machine: Machine, low: FloatArray, high: FloatArray, rest: FloatArray
) -> tuple[FloatArray, float]:
    """Middle (3,) and half width of what is shown [m]: the arm in all that is drawn of it."""
    every = []
    for posture in (rest, *_at_limits(low, high, rest)):
        poses = machine.sweeper.link_poses(posture[None])[0]
        every += [
            apply(pose, mesh.vertices)
            for pose, mesh in zip(poses, machine.arm.meshes, strict=True)
            if mesh is not None
        ]
    points = np.concatenate(every)
    least, most = points.min(axis=0), points.max(axis=0)
    return 0.5 * (least + most), 0.5 * _FAR * float((most - least).max())


def _arm(
    axes: Axes, machine: Machine, posture: FloatArray, plane: tuple[int, int], *, faint: bool
) -> None:
    poses = machine.sweeper.link_poses(posture[None])[0]
    for pose, mesh in zip(poses, machine.arm.meshes, strict=True):
        if mesh is None:
            continue
        points = apply(pose, mesh.vertices)[:, plane]
        if faint:
            _outline(axes, points, edgecolor=_ARM, alpha=0.3, linewidth=0.8)
        else:
            _triangles(axes, points, mesh.faces, color=_ARM, alpha=0.9)


def _zone(
    axes: Axes, zone: SolidObject, plane: tuple[int, int], window: tuple[float, float, float]
) -> None:
    if isinstance(zone, Halfspace):
        _halfspace(axes, zone, plane, window)
        return
    points, faces = _surface(zone)
    flat = points[:, plane]
    _triangles(axes, flat, faces, color=_ZONE, alpha=0.1 if isinstance(zone, Mesh) else 0.35)
    ring = zone.margin_m * np.stack([np.cos(_ROUND), np.sin(_ROUND)], axis=1)
    corners = flat[_hull(flat)]
    wide = (corners[:, None] + ring[None]).reshape(-1, 2)
    _outline(axes, wide, edgecolor=_MARGIN, linestyle="--", linewidth=1.0)
    middle = corners.mean(axis=0)
    x, y, half = window
    if abs(middle[0] - x) < half and abs(middle[1] - y) < half:
        moves = " (moves; drawn in its own frame)" if zone.key is not None else ""
        axes.annotate(f"{zone.name}{moves}", middle, color=_ZONE, fontsize=8, ha="center", zorder=9)


def _surface(zone: Box | Sphere | Cylinder | Capsule | Mesh) -> tuple[FloatArray, Any]:
    """Vertices (v, 3) in the world and faces of a zone without its margin."""
    match zone:
        case Box():
            mesh = box_mesh(np.asarray(zone.size_m))
            return apply(zone.pose, mesh.vertices), mesh.faces
        case Sphere():
            mesh = ball_mesh(zone.radius_m)
            return mesh.vertices + np.asarray(zone.center_m), mesh.faces
        case Cylinder():
            mesh = prism_mesh(zone.radius_m, zone.height_m)
            return apply(zone.pose, mesh.vertices), mesh.faces
        case Capsule():
            ball = ball_mesh(zone.radius_m).vertices
            points = np.concatenate([ball + zone.start_m, ball + zone.end_m])
            return points, ConvexHull(points).simplices
        case Mesh():
            mesh = load_mesh(Path(zone.file), np.full(3, zone.scale))
            return apply(zone.pose, mesh.vertices), mesh.faces


def _halfspace(
    axes: Axes, zone: Halfspace, plane: tuple[int, int], window: tuple[float, float, float]
) -> None:
    """Its face as a line, where it is seen from the edge; else it would fill the whole view."""
    normal = np.asarray(zone.normal)[list(plane)]
    length = float(np.linalg.norm(normal))
    if length < _EDGE:
        return
    x, y, half = window
    along, away = np.array([-normal[1], normal[0]]), normal
    foot = np.array([x, y])
    foot = foot - away * (float(foot @ away) - zone.offset_m)
    ends = np.stack([foot - 3.0 * half * along, foot + 3.0 * half * along])
    solid = np.concatenate([ends, ends[::-1] - 6.0 * half * away])
    axes.fill(*solid.T, color=_ZONE, alpha=0.12)
    edge = ends + zone.margin_m * away
    axes.plot(*edge.T, color=_MARGIN, linestyle="--", linewidth=1.0)
    axes.annotate(
        zone.name, (float(foot[0]), float(foot[1])), color=_ZONE, fontsize=8, ha="center", zorder=9
    )


def _triangles(axes: Axes, points: FloatArray, faces: Any, **style: Any) -> None:
    from matplotlib.collections import PolyCollection  # noqa: PLC0415 - an extra

    every = max(1, len(faces) // _MOST_TRIANGLES)
    axes.add_collection(PolyCollection(list(points[faces[::every]]), linewidths=0, **style))
    if every > 1:
        _outline(axes, points, edgecolor=style["color"], linewidth=0.8)


def _outline(axes: Axes, points: FloatArray, **style: Any) -> None:
    axes.fill(*points[_hull(points)].T, fill=False, **style)


def _hull(points: FloatArray) -> Sequence[int]:
    """Corners of the hull of points (n, 2), in order; all of them where they lie on a line."""
    try:
        return [int(corner) for corner in ConvexHull(points).vertices]
    except QhullError:
        return range(len(points))
