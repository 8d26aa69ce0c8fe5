"""A URDF's XML to plain values, each fault with its line and what to do.

Other descriptions of robots (xacro, SDF, MJCF, SRDF) are told apart and refused with the way to
make a URDF of them. In particular xacro is not expanded here: it evaluates Python expressions and
includes whatever file it likes, and a guard's files may come from anybody.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from rampe_guard.collision.urdf_model import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Joint,
    Limit,
    Link,
    Matrix,
    Mesh,
    Mimic,
    Shape,
    Sphere,
    Tree,
)
from rampe_guard.collision.xml_check import read_xml
from rampe_guard.errors import GeometryError

if TYPE_CHECKING:
    from rampe_guard.collision.xml_check import Element

JOINT_TYPES: Final = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_OTHERS: Final = {
    "sdf": "is SDF (Gazebo); give the URDF that it was made from, or convert it: sdf2urdf.py of"
    " pysdf, then see by check that no shape got lost",
    "mujoco": "is MJCF (MuJoCo); give the URDF that it was made from, or convert it: pip install"
    " mjcf-urdf-simple-converter, and in Python: from mjcf_urdf_simple_converter import convert;"
    " convert('IN.xml', 'OUT.urdf'); it leaves out all shapes but meshes: put those in by hand",
    "mujocoinclude": "is a part of an MJCF (MuJoCo) model; give the robot's URDF",
    "COLLADA": "is a COLLADA file; give the URDF that names it",
}
_XACRO: Final = (
    "is xacro, which is no URDF yet; expand it first: xacro IN.xacro > OUT.urdf"
    " (from ROS, or pip install xacrodoc and: xacrodoc IN.xacro -o OUT.urdf)"
)


def parse_urdf(content: bytes, name: str) -> Tree:
    """What a URDF says.

    Args:
        content: of the file.
        name: what messages call it.

    Raises:
        GeometryError: it is no URDF, or a line of it is wrong.
    """
    if name.lower().endswith(".xacro"):
        raise GeometryError(f"{name}: {_XACRO}")
    return _Reader(name).tree(read_xml(content, name))


class _Reader:
    """Reads elements of one file."""

    def __init__(self, name: str) -> None:
        self._name = name

    def tree(self, root: Element) -> Tree:
        """The whole file."""
        self._refuse_others(root)
        links = [self._link(element) for element in root.all("link")]
        joints = [self._joint(element) for element in root.all("joint")]
        for kind in ("link", "joint"):
            seen: dict[str, int] = {}
            for element in root.all(kind):
                name = self._text(element, "name")
                if name in seen:
                    raise self._wrong(
                        element, f"there is a {kind} '{name}' on line {seen[name]} already"
                    )
                seen[name] = element.line
        return Tree(root.get("name") or "", tuple(links), tuple(joints))

    def _refuse_others(self, root: Element) -> None:
        if root.tag in _OTHERS:
            raise GeometryError(f"{self._name}: {_OTHERS[root.tag]}")
        prefixes = {
            key.removeprefix("xmlns:") + ":"
            for key, value in root.attributes.items()
            if key.startswith("xmlns:") and "xacro" in value
        } | {"xacro:"}
        for part in root.children:
            for element in part.walk():
                open_ends = part.tag in ("link", "joint") and any(
                    "${" in value or "$(" in value for value in element.attributes.values()
                )
                if open_ends or element.tag.startswith(tuple(prefixes)):
                    raise GeometryError(f"{self._name}:{element.line}: {_XACRO}")
        if root.tag != "robot":
            raise GeometryError(
                f"{self._name}:{root.line}: its root is <{root.tag}>, that of a URDF is <robot>;"
                " give the robot's URDF"
            )
        if not root.all("link") and (root.all("group") or root.all("disable_collisions")):
            raise GeometryError(f"{self._name}: is an SRDF (MoveIt); give the URDF it is for")

    def _link(self, element: Element) -> Link:
        name = self._text(element, "name")
        collisions = self._shapes(element, "collision")
        # what is only to be looked at may be as wrong as it likes
        visuals = () if collisions else self._shapes(element, "visual")
        return Link(name, collisions, visuals)

    def _shapes(self, link: Element, tag: str) -> tuple[Shape, ...]:
        return tuple(
            Shape(self._origin(element), self._geometry(element)) for element in link.all(tag)
        )

    def _geometry(self, shape: Element) -> Geometry:
        element = self._child(shape, "geometry")
        kinds = element.children
        if len(kinds) != 1:
            raise self._wrong(
                element, f"needs one shape, has {', '.join(k.tag for k in kinds) or 'none'}"
            )
        kind = kinds[0]
        match kind.tag:
            case "mesh":
                return Geometry(tag="mesh", mesh=self._mesh(kind))
            case "box":
                return Geometry(tag="box", box=Box(self._sizes(kind, "size", 3)))
            case "cylinder":
                made = Cylinder(*self._sizes(kind, "radius"), *self._sizes(kind, "length"))
                return Geometry(tag="cylinder", cylinder=made)
            case "capsule":
                round_ended = Capsule(*self._sizes(kind, "radius"), *self._sizes(kind, "length"))
                return Geometry(tag="capsule", capsule=round_ended)
            case "sphere":
                return Geometry(tag="sphere", sphere=Sphere(*self._sizes(kind, "radius")))
            case _:
                return Geometry(tag=kind.tag)

    def _mesh(self, element: Element) -> Mesh:
        name = self._text(element, "filename")
        if element.get("scale") is None:
            return Mesh(name, None)
        scale = self._numbers(element, "scale", (1, 3))
        if not all(math.isfinite(factor) and factor != 0.0 for factor in scale):
            raise self._wrong(
                element,
                f'<mesh> has scale="{element.get("scale")}"; give factors that are finite and not 0'
                ' (scale="0.001 0.001 0.001" for millimetres)',
            )
        return Mesh(name, scale * 3 if len(scale) == 1 else scale)

    def _sizes(self, element: Element, key: str, count: int = 1) -> tuple[float, ...]:
        sizes = self._numbers(element, key, (count,))
        if not all(math.isfinite(size) and size > 0.0 for size in sizes):
            raise self._wrong(
                element,
                f'<{element.tag}> has {key}="{element.get(key)}"; give more than 0 [m]',
            )
        return sizes

    def _joint(self, element: Element) -> Joint:
        name, kind = self._text(element, "name"), self._text(element, "type")
        if kind not in JOINT_TYPES:
            raise self._wrong(
                element, f"joint '{name}' is of type '{kind}'; there are {', '.join(JOINT_TYPES)}"
            )
        axis, limit, mimic = (element.find(tag) for tag in ("axis", "limit", "mimic"))
        return Joint(
            name,
            kind,
            self._text(self._child(element, "parent"), "link"),
            self._text(self._child(element, "child"), "link"),
            self._origin(element),
            None if axis is None else self._numbers(axis, "xyz", (3,), "1 0 0"),
            None if limit is None else self._limit(limit, name, kind),
            None
            if mimic is None
            else Mimic(
                self._text(mimic, "joint"),
                self._number(mimic, "multiplier", "1"),
                self._number(mimic, "offset", "0"),
            ),
        )

    def _limit(self, element: Element, name: str, kind: str) -> Limit:
        """Ends that are read wrongly would move what is guarded without a word: none is guessed."""
        lower, upper, velocity = (
            None if element.get(key) is None else self._number(element, key)
            for key in ("lower", "upper", "velocity")
        )
        joint = f"joint '{name}'"
        if kind in ("revolute", "prismatic"):  # the others have no ends
            for key, end in (("lower", lower), ("upper", upper)):
                if end is not None and math.isnan(end):
                    raise self._wrong(
                        element, f'{joint} has {key}="{element.get(key)}"; give a number [rad or m]'
                    )
            if lower is not None and upper is not None:
                self._check_ends(element, joint, lower, upper)
        if kind != "fixed" and velocity is not None and not velocity >= 0.0:
            raise self._wrong(
                element,
                f'{joint} has velocity="{element.get("velocity")}"; give its top speed [rad/s or'
                " m/s], or leave it out",
            )
        return Limit(lower, upper, velocity)

    def _check_ends(self, element: Element, joint: str, lower: float, upper: float) -> None:
        if lower > upper:
            raise self._wrong(
                element, f"{joint} has lower={lower:g} above upper={upper:g}; correct them"
            )
        if math.isinf(lower) != math.isinf(upper) or lower == upper in (math.inf, -math.inf):
            raise self._wrong(
                element,
                f"{joint} has lower={lower:g} and upper={upper:g}; give two finite ends, or none"
                ' (type="continuous")',
            )

    def _origin(self, above: Element) -> Matrix | None:
        element = above.find("origin")
        if element is None:
            return None
        place = self._numbers(element, "xyz", (3,), "0 0 0")
        return pose_of(place, self._numbers(element, "rpy", (3,), "0 0 0"))

    def _child(self, element: Element, tag: str) -> Element:
        child = element.find(tag)
        if child is None:
            named = f" '{element.get('name')}'" if element.get("name") else ""
            raise self._wrong(element, f"<{element.tag}>{named} has no <{tag}>")
        return child

    def _text(self, element: Element, key: str) -> str:
        value = (element.get(key) or "").strip()
        if not value:
            raise self._wrong(element, f"<{element.tag}> has no {key}")
        return value

    def _number(self, element: Element, key: str, default: str | None = None) -> float:
        return self._numbers(element, key, (1,), default)[0]

    def _numbers(
        self, element: Element, key: str, counts: tuple[int, ...], default: str | None = None
    ) -> tuple[float, ...]:
        value = element.get(key)
        if value is None:
            value = default
        if value is None:
            raise self._wrong(element, f"<{element.tag}> has no {key}")
        try:
            numbers = tuple(float(word) for word in value.replace(",", " ").split())
        except ValueError:
            numbers = ()
        if len(numbers) not in counts:
            wanted = " or ".join(str(count) for count in counts)
            raise self._wrong(
                element, f'<{element.tag}> has {key}="{value[:80]}"; give {wanted} number(s)'
            )
        return numbers

    def _wrong(self, element: Element, words: str) -> GeometryError:
        return GeometryError(f"{self._name}:{element.line}: {words}")


def pose_of(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> Matrix:
    """The pose (4, 4) of an origin: turned about fixed x, then y, then z [rad], and moved [m]."""
    if not all(math.isfinite(angle) for angle in rpy):
        rpy = (math.nan,) * 3  # the sine of infinity warns; who uses it says whose origin it is
    si, sj, sk = np.sin(rpy).tolist()
    ci, cj, ck = np.cos(rpy).tolist()
    return (
        (cj * ck, sj * (si * ck) - ci * sk, sj * (ci * ck) + si * sk, xyz[0]),
        (cj * sk, sj * (si * sk) + ci * ck, sj * (ci * sk) - si * ck, xyz[1]),
        (-sj, cj * si, cj * ci, xyz[2]),
        (0.0, 0.0, 0.0, 1.0),
    )
