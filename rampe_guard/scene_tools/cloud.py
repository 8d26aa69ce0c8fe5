"""A point cloud → boxes (and perhaps a ground) that hold every point of it.

What is left out is what the caller says, and it is counted: points outside of the crop, the arm's
own, lone voxels, points that are no numbers. Nothing else is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from rampe_guard.core.types import FloatArray
from rampe_guard.errors import GeometryError
from rampe_guard.scene_tools.cloud_read import read_points
from rampe_guard.scene_tools.draft import Common, Draft, DraftObject, Names, placed, plain
from rampe_guard.scene_tools.voxels import MOST, Index, Voxels, alone, boxes, coarser, gather

Tell = Callable[[str], None]
LEAST_VOXEL_M: Final = 0.005
GRAIN_M: Final = 1e-4
"""Boxes are rounded outwards to this, and grown by it, so that no point lies on a face [m]."""
FEW_POINTS: Final = 3
"""Lone voxels of fewer points are told, even if nobody asked."""
_FAR_M: Final = 20_000.0


@dataclass(frozen=True, slots=True)
class CloudWishes:
    """How a cloud is taken.

    Attributes:
        voxel_m: side of the voxels [m].
        most: so many objects at the most.
        scale: factor from the file's unit to metres [-].
        crop: low and high corner in the world (2, 3) [m]; outside of it points are left out.
        ground_z_m: points up to here are held by a halfspace [m], the others by boxes.
        min_points: lone voxels of fewer points are left out; 0 keeps all.
        skip_invalid: points that are no numbers are left out, too, and not refused.
        arm: points (n, 3) [m] on the surface of the arm where it stood.
        arm_margin_m: points as near to these are the arm's own, and left out [m].
    """

    voxel_m: float
    most: int
    scale: float = 1.0
    crop: FloatArray | None = None
    ground_z_m: float | None = None
    min_points: int = 0
    skip_invalid: bool = False
    arm: FloatArray | None = None
    arm_margin_m: float = 0.1


@dataclass(slots=True)
class _Counts:
    """Points by what became of them."""

    file: str
    all: int = 0
    invalid: int = 0
    cropped: int = 0
    own: int = 0
    ground: int = 0
    lowest_m: float = math.inf
    notes: list[str] = field(default_factory=list)


def import_cloud(
    file: Path,
    names: Names,
    common: Common,
    wishes: CloudWishes,
    *,
    name: str | None = None,
    tell: Tell = lambda _: None,
) -> Draft:
    """Boxes that hold every point of a cloud.

    Args:
        file: LAS, PLY, or lines of x y z.
        names: of the scene.
        common: pose, margin, links.
        wishes: how.
        name: with which the names of the objects begin; the file's if left out.
        tell: takes words on what is done now.

    Raises:
        GeometryError: naming the file and what is wrong with it.
    """
    counts = _Counts(str(file))
    try:
        pieces = _counted(read_points(file), str(file), tell)
        voxels = gather(_wanted(pieces, common.pose, wishes, counts), wishes.voxel_m)
    except ValueError:
        raise GeometryError(
            f"{file}: spans more than {2 * MOST} voxels of {wishes.voxel_m:g} m; give --crop, a"
            " larger --voxel, or the --xyz that takes the machine's place to the origin"
        ) from None
    if not counts.all:
        raise GeometryError(f"{file}: holds no points")
    title = file.stem if name is None else name
    objects: list[DraftObject] = []
    if counts.ground and wishes.ground_z_m is not None:
        fields = {
            "type": "halfspace",
            "normal": [0.0, 0.0, 1.0],
            "offset_m": plain(math.ceil(wishes.ground_z_m / GRAIN_M + 1.0) * GRAIN_M),
        }
        objects.append(DraftObject(names.new(f"{title}-ground"), {**fields, **common.fields()}))
    voxels = _without_lone(voxels, wishes, counts)
    if not len(voxels.keys) and not objects:
        raise GeometryError(f"{file}: none of its {counts.all} points is left; see --crop")
    found, used = _few(voxels, wishes.most - len(objects), counts, tell)
    for number, corners in enumerate(found, 1):
        objects.append(_box(corners, used, names.new(f"{title}-{number}"), common))
    notes = (*_told(counts, wishes), *counts.notes, *_size(found, used, voxels, str(file)))
    return Draft(tuple(objects), notes)


def _counted(pieces: Iterable[FloatArray], file: str, tell: Tell) -> Iterator[FloatArray]:
    """The same pieces, told."""
    count = 0
    for piece in pieces:
        count += len(piece)
        tell(f"{file}: {count:,} points read")
        yield piece


def _wanted(
    pieces: Iterable[FloatArray], pose: FloatArray, wishes: CloudWishes, counts: _Counts
) -> Iterator[FloatArray]:
    """Points in the world [m] that boxes must hold."""
    tree = None
    if wishes.arm is not None:
        from scipy.spatial import KDTree  # noqa: PLC0415 - rarely needed

        tree = KDTree(wishes.arm)
    for piece in pieces:
        counts.all += len(piece)
        points = _valid(piece, wishes, counts)
        points = (points * wishes.scale) @ pose[:3, :3].T + pose[:3, 3]
        if wishes.crop is not None:
            low, high = wishes.crop
            inside = ((points >= low) & (points <= high)).all(axis=1)
            counts.cropped += int((~inside).sum())
            points = points[inside]
        if len(points) and not np.abs(points).max() < _FAR_M:
            raise GeometryError(
                f"{counts.file}: a point {np.abs(points).max():.4g} m from the origin; give the"
                " --xyz that takes the machine's place to the origin (a survey's grid begins far"
                " away), --scale 0.001 for millimetres, or --crop"
            )
        if tree is not None and len(points):
            own = np.isfinite(tree.query(points, distance_upper_bound=wishes.arm_margin_m)[0])
            counts.own += int(own.sum())
            points = points[~own]
        if len(points):
            counts.lowest_m = min(counts.lowest_m, float(points[:, 2].min()))
        if wishes.ground_z_m is not None:
            above = points[:, 2] > wishes.ground_z_m
            counts.ground += int((~above).sum())
            points = points[above]
        yield points


def _valid(piece: FloatArray, wishes: CloudWishes, counts: _Counts) -> FloatArray:
    fine = np.isfinite(piece).all(axis=1)
    if fine.all():
        return piece
    counts.invalid += int((~fine).sum())
    if not wishes.skip_invalid:
        first = counts.all - len(piece) + int(np.flatnonzero(~fine)[0]) + 1
        raise GeometryError(
            f"{counts.file}: point {first} is {piece[~fine][0].tolist()}, not finite; clean the"
            " cloud, or say --skip-invalid if such points are beams without an echo"
        )
    return piece[fine]


def _without_lone(voxels: Voxels, wishes: CloudWishes, counts: _Counts) -> Voxels:
    few = wishes.min_points or FEW_POINTS
    lone = alone(voxels, few)
    number = int(lone.sum())
    if not number:
        return voxels
    what = f"{number} voxels stand alone with fewer than {few} points"
    if not wishes.min_points:
        said = f"{what}: kept; --min-points {few} leaves such out (dust? a wire?)"
        counts.notes.append(f"{counts.file}: {said}")
        return voxels
    points, (x, y, z) = int(voxels.counts[lone].sum()), voxels.index[lone][0] * voxels.side_m
    counts.notes.append(
        f"{counts.file}: {what} ({points} points, the first near {x:.2f} {y:.2f} {z:.2f}): LEFT OUT"
    )
    return Voxels(voxels.side_m, voxels.keys[~lone], voxels.counts[~lone])


def _few(voxels: Voxels, most: int, counts: _Counts, tell: Tell) -> tuple[FloatArray, Voxels]:
    """So many boxes at most, of voxels as fine as that allows."""
    factor, used = 1, voxels

    def joined() -> Index:
        count, side = len(used.keys), f"{used.side_m:g} m"
        tell(f"{counts.file}: joining {count:,} voxels of {side} to at most {most} boxes")
        return boxes(used)

    found = joined()
    while len(found) > max(most, 1):
        factor = max(factor + 1, factor * 5 // 4)
        used = coarser(voxels, factor)
        found = joined()
    if factor > 1:
        counts.notes.append(
            f"{counts.file}: voxels of {used.side_m:g} m instead of {voxels.side_m:g} m, so that"
            f" {most} objects are enough (--max-objects); --crop what matters to keep it finer"
        )
    return np.asarray(found * used.side_m, float), used


def _box(corners: FloatArray, used: Voxels, name: str, common: Common) -> DraftObject:
    low = np.floor(corners[0] / GRAIN_M - 1.0) * GRAIN_M
    high = np.ceil(corners[1] / GRAIN_M + 1.0) * GRAIN_M
    pose = np.eye(4)
    pose[:3, 3] = 0.5 * (low + high)
    size = [plain(v) for v in np.maximum(high - low, used.side_m)]
    return DraftObject(name, {"type": "box", "size": size, "pose": placed(pose), **common.fields()})


def _told(counts: _Counts, wishes: CloudWishes) -> Iterator[str]:
    """What became of the points."""
    inside = counts.all - counts.invalid - counts.cropped - counts.own - counts.ground
    yield f"{counts.file}: {counts.all} points, {inside} of them above any ground and kept"
    for number, what in (
        (counts.invalid, "are not finite (--skip-invalid)"),
        (counts.cropped, "lie outside of --crop"),
        (counts.own, f"are the arm's own, within {wishes.arm_margin_m:g} m of it (--without-arm)"),
    ):
        if number:
            yield f"{counts.file}: {number} points {what}: LEFT OUT"
    if counts.ground:
        yield (
            f"{counts.file}: {counts.ground} points, the lowest at z {counts.lowest_m:.2f} m, are"
            f" held by the ground up to {wishes.ground_z_m:g} m"
        )


def _size(found: FloatArray, used: Voxels, asked: Voxels, file: str) -> Iterator[str]:
    """How much larger the boxes are than what was seen."""
    if not len(found):
        return
    volume = float(np.prod(found[:, 1] - found[:, 0], axis=1).sum())
    fine = len(asked.keys) * asked.side_m**3
    far = math.sqrt(3.0) * used.side_m
    yield (
        f"{file}: {len(found)} boxes, {volume:.4g} m3, {volume / fine:.2f} times the"
        f" {len(asked.keys)} voxels of {asked.side_m:g} m; no place in them is farther than"
        f" {far:.2g} m from a point"
    )
