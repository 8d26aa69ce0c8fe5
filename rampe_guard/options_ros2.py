"""Options of ``rampe-guard ros2``."""

from __future__ import annotations

import argparse

from rampe_guard.options import add_connect, positive


def add_ros2_actions(ros2: argparse.ArgumentParser) -> None:
    """What to do with ROS 2."""
    actions = ros2.add_subparsers(required=True, metavar="ACTION", dest="action")
    topics = actions.add_parser("topics", help="topics, types and keys of a site, and its joints")
    topics.add_argument("site", help="site file (YAML) with format: ros2")

    description = actions.add_parser(
        "description", help="write the URDF that a robot publishes, to be looked at and kept"
    )
    description.add_argument("source", help="ROS bag, or site file (YAML): ask its live robot")
    description.add_argument("out", help="URDF file to write")
    description.add_argument(
        "--topic",
        default="/robot_description",
        help="std_msgs/String, latched (default /robot_description)",
    )
    description.add_argument("--force", action="store_true", help="replace the file")
    text = "for a live robot, in seconds (default 5)"
    description.add_argument("--wait", type=positive, default=5.0, help=text)
    add_connect(description)

    bag = actions.add_parser("bag", help="a recording, or a CSV log, as a ROS bag")
    bag.add_argument("site", help="site file (YAML)")
    bag.add_argument("log", help="recording (MCAP), or a CSV file as the site file's 'log' says")
    bag.add_argument("out", help="folder to write")
