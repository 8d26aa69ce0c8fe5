"""The part of a site file that says how ROS 2 is spoken, and what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from rampe_guard.settings import ros2_keys
from rampe_guard.settings.model import Model, Text
from rampe_guard.settings.problems import KeyPath, Problems, show
from rampe_guard.settings.ros2_keys import Ros2Settings, RosType

if TYPE_CHECKING:
    from rampe_guard.settings.site_model import SiteModel

INPUTS: tuple[tuple[str, RosType], ...] = (
    ("joystick", ros2_keys.JOY),
    ("actuators", ros2_keys.JOINT_STATE),
)


class Ros2Model(Model):
    """How ROS 2 is spoken where the format is ros2."""

    transport: Literal["rmw_zenoh", "ros2dds"] = Field(
        default="rmw_zenoh",
        description="What lies between ROS 2 and Zenoh: rmw_zenoh, or ros2dds (the bridge "
        "zenoh-plugin-ros2dds).",
    )
    domain: Annotated[int, Field(ge=0, le=232)] = Field(
        default=0, description="The ROS_DOMAIN_ID, which is part of the keys of rmw_zenoh."
    )
    type_hash: bool = Field(
        default=True,
        description="True if keys of rmw_zenoh end with the hash of the type; false for ROS 2 "
        "Humble.",
    )
    publish: bool = Field(
        default=True,
        description="True if diagnostics and markers are published for tools of ROS 2.",
    )
    node: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,63}$")] = Field(
        default="rampe_guard",
        description="The name of the guard's node; its markers are on /NODE/markers.",
    )
    frame: Text = Field(
        default="world", description="The name of the frame that the world is in ROS 2's tf."
    )


def exact_key(model: SiteModel, name: str, kind: RosType) -> str:
    """``keys.NAME`` as a Zenoh key, also where it is a topic."""
    said: str = getattr(model.keys, name)
    if model.format != "ros2" or not said.startswith("/"):
        return said
    ros = model.ros2 or Ros2Model()
    return ros2_keys.key_of(said, kind, ros.transport, ros.domain, type_hash=ros.type_hash)


def check_ros2(model: SiteModel, problems: Problems) -> None:
    """Add what is wrong with topics, whole keys and the block itself."""
    if model.format != "ros2":
        if model.ros2 is not None:
            problems.add(("ros2",), "is given, and format is json", "write format: ros2 beside it")
        return
    for name, kind in INPUTS:
        said: str = getattr(model.keys, name)
        path: KeyPath = ("keys", name)
        if said.startswith("/"):
            if not ros2_keys.is_topic(said):
                what = f"{show(said)} is no ROS 2 topic"
                problems.add(path, what, "give its full name, such as /arm/joint_states")
        elif why := ros2_keys.wrong_type(said, kind):
            problems.add(path, f"{show(said)} {why}", "give the topic instead, such as /joy")


def ros2_settings(model: SiteModel) -> Ros2Settings | None:
    """The same as values; None where the format is another."""
    if model.format != "ros2":
        return None
    joystick, actuators = (
        ros2_keys.topic_of(exact_key(model, name, kind)) for name, kind in INPUTS
    )
    said = model.ros2 or Ros2Model()
    return Ros2Settings(**said.model_dump(), joystick_topic=joystick, actuators_topic=actuators)
