"""What ``rampe-guard init`` is told of ROS 2, and what its site file says of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from rampe_guard.errors import SettingsError
from rampe_guard.programs.initing_plan import Said
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.recording import McapReading, is_mcap
from rampe_guard.recording.bag import is_bag
from rampe_guard.settings.ros2_model import Ros2Model, Speech

JOYSTICK_TOPIC: Final = "/joy"
ACTUATORS_TOPIC: Final = "/joint_states"
"""Where drivers publish, unless they are told otherwise."""


def settled(wishes: Wishes) -> Wishes:
    """The same with a format: as told, or as the recording is.

    Raises:
        SettingsError: what was told of it does not fit together.
        LogError: the recording cannot be read.
    """
    bag = wishes.log is not None and _of_ros2(wishes.log)
    if bag and wishes.format == "json":
        raise SettingsError(f"{wishes.log}: holds messages of ROS 2; leave out --format json")
    if wishes.log is not None and not bag and wishes.format == "ros2":
        raise SettingsError(f"{wishes.log}: holds no messages of ROS 2; leave out --format ros2")
    if bag or wishes.format == "ros2":
        return replace(wishes, format="ros2")
    told = {
        "--transport": wishes.transport is not None,
        "--domain": wishes.domain is not None,
        "--no-type-hash": not wishes.type_hash,
    }
    if any(told.values()):
        option = next(option for option, given in told.items() if given)
        raise SettingsError(f"{option} is of ROS 2; give --format ros2 with it")
    if wishes.live:
        for key in (wishes.joystick, wishes.actuators):
            if key is not None and key.startswith("/"):
                raise SettingsError(f"{key} is a topic of ROS 2; give --format ros2 with it")
    return replace(wishes, format="json")


def _of_ros2(log: str) -> bool:
    """Whether it is a bag, or an MCAP file with CDR in it."""
    if is_bag(log):
        return True
    channels = McapReading(log).channels.values() if is_mcap(log) else ()
    return any(channel.message_encoding == "cdr" for channel in channels)


def speech(wishes: Wishes) -> Speech:
    """Topics, and how they travel; what was not told is as usual.

    Raises:
        SettingsError: a topic is none.
    """
    block = Ros2Model(
        transport=wishes.transport or "rmw_zenoh",
        domain=wishes.domain or 0,
        type_hash=wishes.type_hash,
    )
    said = {
        "joystick": wishes.joystick or JOYSTICK_TOPIC,
        "actuators": wishes.actuators or ACTUATORS_TOPIC,
    }
    found = Speech("ros2", block, said)
    if wrongs := [f"--{where}: {what}; {remedy}" for where, what, remedy in found.wrongs()]:
        raise SettingsError(*wrongs)
    return found


def block_of(wishes: Wishes) -> dict[str, Said]:
    """The block ``ros2`` of the site file, each value with where it came from."""
    found = speech(wishes)
    ros = found.block or Ros2Model()
    heard = wishes.live and all(said.startswith("/") for said in found.said.values())

    def why(what: str, *, told: bool) -> tuple[str, bool]:
        if heard or told:
            return f"{what}; {'heard so' if heard else 'given'}", False
        return f"{what}: nothing told it", True

    block = {
        "transport": Said(
            ros.transport, *why("rmw_zenoh or ros2dds", told=wishes.transport is not None)
        )
    }
    if ros.transport == "rmw_zenoh":
        domain = why("ROS_DOMAIN_ID", told=wishes.domain is not None)
        block["domain"] = Said(ros.domain, *domain)
        if not ros.type_hash:
            block["type_hash"] = Said(ros.type_hash, *why("ROS 2 Humble has none", told=True))
    return block
