"""A URDF as plain values: what an arm needs of it. Meshes are named, not read."""

from __future__ import annotations

from typing import Final

import msgspec

LAYOUT: Final = 3
"""Count up when the classes below, or what is read into them, change."""

Matrix = tuple[tuple[float, ...], ...]


class Mesh(msgspec.Struct, frozen=True):
    """A mesh file; ``scale`` three factors."""

    filename: str
    scale: tuple[float, ...] | None


class Box(msgspec.Struct, frozen=True):
    """Edges [m]."""

    size: tuple[float, ...]


class Cylinder(msgspec.Struct, frozen=True):
    """Along z, about its middle [m]."""

    radius: float
    length: float


class Capsule(msgspec.Struct, frozen=True):
    """Along z, about its middle [m]; ``length`` without the round ends."""

    radius: float
    length: float


class Sphere(msgspec.Struct, frozen=True):
    """About its middle [m]."""

    radius: float


class Geometry(msgspec.Struct, frozen=True, kw_only=True):
    """One of them; of a kind that we do not know only its ``tag``."""

    tag: str
    mesh: Mesh | None = None
    box: Box | None = None
    cylinder: Cylinder | None = None
    capsule: Capsule | None = None
    sphere: Sphere | None = None


class Shape(msgspec.Struct, frozen=True):
    """A geometry and where it is in its link (4, 4)."""

    origin: Matrix | None
    geometry: Geometry


class Link(msgspec.Struct, frozen=True):
    """A link and its shapes: what collides, or else (and only else) what is seen."""

    name: str
    collisions: tuple[Shape, ...]
    visuals: tuple[Shape, ...]

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Those that count."""
        return self.collisions or self.visuals


class Limit(msgspec.Struct, frozen=True):
    """Ends of a joint [rad or m], and its top speed [rad/s or m/s]."""

    lower: float | None
    upper: float | None
    velocity: float | None


class Mimic(msgspec.Struct, frozen=True):
    """The joint that another follows: value = multiplier * that one's + offset."""

    joint: str
    multiplier: float
    offset: float


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
