"""The part of a site file, or of an access list, that says how ROS 2 is spoken."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
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
    domain: Annotated[int, Field(ge=0, le=ros2_keys.MOST_DOMAIN)] = Field(
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


@dataclass(frozen=True, slots=True)
class Speech:
    """What a file says of how one machine speaks.

    Attributes:
        format: of the messages.
        block: how ROS 2 is spoken, if it says that.
        said: both inputs by their names in `INPUTS`, each a Zenoh key or a topic.
    """

    format: str
    block: Ros2Model | None
    said: Mapping[str, str]

    @property
    def keys(self) -> dict[str, str]:
        """Both inputs as Zenoh keys."""
        return {name: self._key(self.said[name], kind) for name, kind in INPUTS}

    @property
    def settings(self) -> Ros2Settings | None:
        """The block as values; None where the format is another."""
        if self.format != "ros2":
            return None
        joystick, actuators = map(ros2_keys.topic_of, self.keys.values())
        said = self.block or Ros2Model()
        return Ros2Settings(**said.model_dump(), joystick_topic=joystick, actuators_topic=actuators)

    def wrongs(self) -> Iterator[tuple[str, str, str]]:
        """What is wrong with topics, whole keys and the block: where, what, and what to do."""
        if self.format != "ros2":
            if self.block is not None:
                yield "ros2", "is given, and format is json", "write format: ros2 beside it"
            return
        for name, kind in INPUTS:
            said = self.said[name]
            if said.startswith("/"):
                if not ros2_keys.is_topic(said):
                    what = f"{show(said)} is no ROS 2 topic"
                    yield name, what, "give its full name, such as /arm/joint_states"
            elif why := ros2_keys.wrong_type(said, kind):
                yield name, f"{show(said)} {why}", "give the topic instead, such as /joy"

    def _key(self, said: str, kind: RosType) -> str:
        if self.format != "ros2" or not said.startswith("/"):
            return said
        ros = self.block or Ros2Model()
        return ros2_keys.key_of(said, kind, ros.transport, ros.domain, type_hash=ros.type_hash)


def speech_of(model: SiteModel) -> Speech:
    """What a site file says of it."""
    said = {name: getattr(model.keys, name) for name, _ in INPUTS}
    return Speech(model.format, model.ros2, said)


def check_ros2(model: SiteModel, problems: Problems) -> None:
    """Add what is wrong with topics, whole keys and the block itself."""
    for where, what, remedy in speech_of(model).wrongs():
        path: KeyPath = (where,) if where == "ros2" else ("keys", where)
        problems.add(path, what, remedy)
