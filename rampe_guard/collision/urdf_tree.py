"""A URDF as plain values: what `load_arm` needs of it, read once by yourdfpy and kept.

yourdfpy brings trimesh, networkx and more with it, a second of imports; what it read from a file
with the same bytes is kept beside the shapes (see `shape_cache`), and then none of that is needed.
"""

from __future__ import annotations

import hashlib
import io
from contextlib import suppress
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import msgspec
import numpy as np

from rampe_guard.collision.shape_cache import default_cache
from rampe_guard.collision.xml_check import check_xml
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from pathlib import Path

MAX_BYTES: Final = 16 * 2**20
_LAYOUT: Final = 1
"""Count up when the classes below change."""

Matrix = tuple[tuple[float, ...], ...]


class Mesh(msgspec.Struct, frozen=True):
    """A mesh file; ``scale`` one or three factors."""

    filename: str
    scale: float | tuple[float, ...] | None


class Box(msgspec.Struct, frozen=True):
    """Edges [m]."""

    size: tuple[float, ...]


class Cylinder(msgspec.Struct, frozen=True):
    """Along z, about its middle [m]."""

    radius: float
    length: float


class Sphere(msgspec.Struct, frozen=True):
    """About its middle [m]."""

    radius: float


class Geometry(msgspec.Struct, frozen=True):
    """One of them; none for a kind that we do not know."""

    mesh: Mesh | None
    box: Box | None
    cylinder: Cylinder | None
    sphere: Sphere | None


class Shape(msgspec.Struct, frozen=True):
    """A geometry and where it is in its link (4, 4)."""

    origin: Matrix | None
    geometry: Geometry


class Link(msgspec.Struct, frozen=True):
    """A link and its shapes."""

    name: str
    collisions: tuple[Shape, ...]
    visuals: tuple[Shape, ...]


class Limit(msgspec.Struct, frozen=True):
    """Ends of a joint [rad or m]."""

    lower: float | None
    upper: float | None


class Mimic(msgspec.Struct, frozen=True):
    """The joint that another follows, and how."""

    joint: str
    multiplier: float | None
    offset: float | None


class Joint(msgspec.Struct, frozen=True):
    """A joint; ``origin`` (4, 4) and ``axis`` (3,) in its parent's and its own frame."""

    name: str
    type: str
    parent: str
    child: str
    origin: Matrix | None
    axis: tuple[float, ...] | None
    limit: Limit | None
    mimic: Mimic | None


class Tree(msgspec.Struct, frozen=True):
    """All of it, in the order of the file."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]


def read_tree(path: Path) -> Tree:
    """The tree of a URDF; meshes are named, not read.

    Raises whatever yourdfpy does where the file is no URDF, and GeometryError where it is no
    plain XML.
    """
    said = f"urdf {_LAYOUT} yourdfpy {version('yourdfpy')} ".encode()
    with path.open("rb") as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise GeometryError(f"{path}: is larger than {MAX_BYTES // 2**20} MB; give a smaller URDF")
    key = hashlib.sha256(said + content).hexdigest()
    cache = default_cache()
    kept = cache.get_tree(key)
    if kept is not None:
        with suppress(msgspec.MsgspecError):  # else it is read anew
            return msgspec.msgpack.decode(kept, type=Tree)
    check_xml(io.BytesIO(content), str(path))
    tree = _read(content)
    cache.put_tree(key, msgspec.msgpack.encode(tree))
    return tree


def _read(content: bytes) -> Tree:
    # only here: it takes a second to import
    import yourdfpy  # noqa: PLC0415

    robot = yourdfpy.URDF.load(
        io.BytesIO(content), load_meshes=False, load_collision_meshes=False, build_scene_graph=False
    ).robot
    return Tree(
        str(robot.name),
        tuple(
            Link(str(link.name), _shapes(link.collisions), _shapes(link.visuals))
            for link in robot.links
        ),
        tuple(_joint(joint) for joint in robot.joints),
    )


def _shapes(shapes: Any) -> tuple[Shape, ...]:
    return tuple(Shape(_matrix(shape.origin), _geometry(shape.geometry)) for shape in shapes)


def _geometry(given: Any) -> Geometry:
    mesh, box, cylinder, sphere = given.mesh, given.box, given.cylinder, given.sphere
    return Geometry(
        None if mesh is None else Mesh(str(mesh.filename), _scale(mesh.scale)),
        None if box is None else Box(_row(box.size)),
        None if cylinder is None else Cylinder(float(cylinder.radius), float(cylinder.length)),
        None if sphere is None else Sphere(float(sphere.radius)),
    )


def _joint(joint: Any) -> Joint:
    limit, mimic = joint.limit, joint.mimic
    return Joint(
        str(joint.name),
        str(joint.type),
        str(joint.parent),
        str(joint.child),
        _matrix(joint.origin),
        None if joint.axis is None else _row(joint.axis),
        None if limit is None else Limit(_number(limit.lower), _number(limit.upper)),
        None
        if mimic is None
        else Mimic(str(mimic.joint), _number(mimic.multiplier), _number(mimic.offset)),
    )


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _row(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _scale(scale: Any) -> float | tuple[float, ...] | None:
    return _row(scale) if np.ndim(scale) else _number(scale)


def _matrix(origin: Any) -> Matrix | None:
    return None if origin is None else tuple(_row(row) for row in origin)
