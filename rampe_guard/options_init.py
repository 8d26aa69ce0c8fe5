"""Options of ``init`` and ``check``."""

from __future__ import annotations

import argparse
import csv

from rampe_guard.options import add_site, positive

_MOST_DOMAIN = 232


def add_init(parser: argparse.ArgumentParser) -> None:
    """A URDF, a look at the machine, and where the files go."""
    parser.add_argument("urdf", help="URDF of the arm")
    parser.add_argument("--out", required=True, metavar="FOLDER", help="for the files made")
    parser.add_argument("--site", default="my-site", metavar="NAME", help="(default my-site)")
    parser.add_argument("--machine", default="", metavar="NAME", help="(default: of the URDF)")
    source = parser.add_argument_group("measure the machine from a recording, or live")
    text = "recording (MCAP), ROS bag, or a CSV log"
    source.add_argument("--log", metavar="FILE", help=text)
    source.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="listen on it, live"
    )
    source.add_argument("--zenoh", metavar="FILE", help="Zenoh configuration file instead (json5)")
    source.add_argument(
        "--plain-network",
        action="store_true",
        help="accept that anyone on the network of --connect can read and forge messages",
    )
    text = "key of the joystick, or topic of ROS 2 (then default /joy); of a CSV log its columns,"
    text += " in the order of the axes: NAME[:SCALE[:OFFSET]],… (default u_NAME of each NAME)"
    source.add_argument("--joystick", metavar="KEY", help=text)
    text = "key of the actuators, or topic (default /joint_states); of a CSV log the columns of the"
    source.add_argument(
        "--actuators", metavar="KEY", help=f"{text} positions, written the same way"
    )
    source.add_argument(
        "--time", metavar="COLUMN", help="of a CSV log (default t); COLUMN:SCALE makes it [s]"
    )
    source.add_argument(
        "--seconds", type=positive, default=60.0, help="for how long to listen live (default 60)"
    )
    ros2 = parser.add_argument_group("messages of ROS 2, as the ros2 block of a site file says it")
    text = "of the messages (default json; a ROS bag is ros2)"
    ros2.add_argument("--format", choices=("json", "ros2"), help=text)
    ros2.add_argument(
        "--transport",
        choices=("rmw_zenoh", "ros2dds"),
        help="what lies between ROS 2 and Zenoh (default rmw_zenoh)",
    )
    text = "ROS_DOMAIN_ID, 0 to 232 (default 0)"
    ros2.add_argument("--domain", type=domain, metavar="N", help=text)
    ros2.add_argument(
        "--no-type-hash",
        action="store_false",
        dest="type_hash",
        help="keys of rmw_zenoh have no hash of the type: ROS 2 Humble",
    )
    arm = parser.add_argument_group("what messages do not say")
    arm.add_argument(
        "--joints",
        type=names,
        default=(),
        metavar="A,B",
        help="joints of the URDF in the order of the positions (default: by name, or the URDF's)",
    )
    arm.add_argument("--names", type=names, default=(), metavar="A,B", help="of the actuators")
    arm.add_argument(
        "--cylinder",
        action="append",
        default=[],
        dest="cylinders",
        metavar="NAME=BASE,ROD,LENGTH[,ANGLE[,DIRECTION]]",
        help="the actuator NAME is a hydraulic cylinder: base_m, rod_m, length_at_zero_m,"
        " angle_offset_rad, direction of its drive",
    )
    arm.add_argument(
        "--package-dir",
        action="append",
        default=[],
        dest="package_dirs",
        metavar="FOLDER",
        help="where package:// meshes are looked for",
    )
    parser.add_argument("--yes", action="store_true", help="ask nothing, even on a terminal")
    parser.add_argument("--force", action="store_true", help="write over what is there")


def add_check(parser: argparse.ArgumentParser) -> None:
    """A site file, and how deep to look."""
    add_site(parser, connect=True)
    text = "draw the arm among its zones: PNG, SVG or PDF (needs the extra [eval])"
    parser.add_argument("--picture", metavar="FILE", help=text)
    text = "also hear the machine: rates, ages, clocks, refusals, and signs against the site file"
    parser.add_argument("--live", action="store_true", help=text)
    parser.add_argument(
        "--seconds", type=positive, default=5.0, help="for how long, with --live (default 5)"
    )


def domain(text: str) -> int:
    """A ROS_DOMAIN_ID."""
    if not (text.isascii() and text.isdigit() and int(text) <= _MOST_DOMAIN):
        raise argparse.ArgumentTypeError(f"{text!r} is none of 0 to {_MOST_DOMAIN}")
    return int(text)


def names(text: str) -> tuple[str, ...]:
    """Names with commas between them; one that has a comma in it stands in double quotes."""
    try:
        found = tuple(part.strip() for part in next(csv.reader([text], skipinitialspace=True), []))
    except csv.Error:
        found = ()
    if not found or not all(found):
        raise argparse.ArgumentTypeError(f"{text!r} has an empty name")
    return found
