"""Options of ``rampe-guard scene import``, ``export`` and ``diff``."""

from __future__ import annotations

import argparse
from typing import Any

from rampe_guard.options import positive, positive_int


def add_scene_tools(actions: Any) -> None:
    """Further actions of ``scene``, on files alone."""
    add_import(actions.add_parser("import", help="a file of another kind, into a scene file"))
    export = actions.add_parser("export", help="as a glTF model (GLB) for a look")
    export.add_argument("file", help="site file, which adds its arm, or scene file (YAML)")
    export.add_argument("out", help="model to write, such as scene.glb")
    diff = actions.add_parser(
        "diff", help="what differs; exit code 0 if nothing does, 1 if something does, 2 on errors"
    )
    diff.add_argument("old", help="scene file, or site file (YAML)")
    diff.add_argument("new", help="the other one")
    diff.add_argument("--json", action="store_true", help="one JSON object")
    for parser in (export, diff):
        _add_allow(parser)


def add_import(parser: argparse.ArgumentParser) -> None:
    """What is imported, and how."""
    parser.add_argument(
        "file",
        help="MoveIt .scene; mesh (STL, OBJ, PLY, GLB, glTF, DAE, OFF); point cloud (LAS, PLY, XYZ"
        " text); GeoJSON plan",
    )
    parser.add_argument("--out", required=True, metavar="SCENE", help="scene file (YAML) to write")
    into = parser.add_mutually_exclusive_group()
    into.add_argument("--append", action="store_true", help="add to the objects that OUT has")
    into.add_argument("--replace", action="store_true", help="write OUT anew if it is there")
    parser.add_argument(
        "--kind", choices=("moveit", "mesh", "cloud", "plan"), help="if the ending does not tell"
    )
    parser.add_argument("--name", help="of the object, or before the names of several")
    for flag, axes, what in (
        ("--xyz", ("X", "Y", "Z"), "where the file's frame is in the world [m]"),
        ("--rpy", ("R", "P", "Y"), "how it is turned: roll, pitch, yaw [rad]"),
    ):
        zero = (0.0, 0.0, 0.0)
        parser.add_argument(flag, nargs=3, type=_number, metavar=axes, default=zero, help=what)
    parser.add_argument("--margin-m", type=_length, help="keep-out distance round all of it [m]")
    parser.add_argument(
        "--ignore-link", action="append", default=[], metavar="LINK", help="link that may touch it"
    )
    _add_allow(parser)
    _add_mesh(parser.add_argument_group("meshes, and meshes in MoveIt scenes"))
    _add_cloud(parser.add_argument_group("point clouds"))
    plan = parser.add_argument_group("GeoJSON plans")
    plan.add_argument("--metres", action="store_true", help="its coordinates are local metres")
    plan.add_argument(
        "--origin",
        nargs=2,
        type=_number,
        metavar=("LON", "LAT"),
        help="they are degrees, and this is the place of --xyz (x east, y north)",
    )


def _add_mesh(group: Any) -> None:
    group.add_argument(
        "--scale", type=positive, help="its unit in metres, 0.001 for mm (default 1)"
    )
    group.add_argument("--up", choices=("y", "z"), help="its axis up (default: y in glTF, else z)")
    group.add_argument(
        "--if-open",
        choices=("refuse", "surface", "hull"),
        help="a mesh that is not closed: refuse it, take its triangles only, or its convex hull"
        " (default refuse)",
    )


def _add_cloud(group: Any) -> None:
    group.add_argument("--voxel", type=positive, metavar="M", help="side of voxels (default 0.1)")
    group.add_argument(
        "--max-objects", type=positive_int, metavar="N", help="coarser if need be (default 300)"
    )
    corners = ("X", "Y", "Z", "X", "Y", "Z")
    group.add_argument(
        "--crop", nargs=6, type=_number, metavar=corners, help="low and high corner in the world"
    )
    group.add_argument(
        "--ground", type=_number, metavar="Z", help="what is not above becomes a halfspace [m]"
    )
    group.add_argument(
        "--min-points", type=positive_int, metavar="N", help="leave out lone voxels of fewer points"
    )
    group.add_argument("--skip-invalid", action="store_true", help="leave out points like NaN")
    group.add_argument("--without-arm", metavar="SITE", help="leave out the points on its arm")
    group.add_argument(
        "--at", nargs="+", type=_number, metavar="Q", help="where its actuators stood [their unit]"
    )
    group.add_argument(
        "--arm-margin-m", type=positive, metavar="M", help="how near is on the arm (default 0.1)"
    )


def _add_allow(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="FOLDER",
        help="meshes of a scene file may lie there, too, beside its own folder",
    )


def _number(text: str) -> float:
    """A finite number."""
    value = float(text)
    if not abs(value) < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not finite")
    return value


def _length(text: str) -> float:
    """0 or more."""
    value = _number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"{text} is below 0")
    return value
