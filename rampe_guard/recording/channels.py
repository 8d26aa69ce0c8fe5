"""What is recorded of a machine: its inputs, and what its guard says, each on a channel.

A channel is known by its role, not by its key: so a recording can be replayed with another site
file, whose keys have other names. Its key and role stand in its metadata; its topic is the key
that a message was really put on, which is another where somebody put on a wildcard.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal, TypeAlias

from rampe_guard.ros2.cdr import store
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY
from rampe_guard.wire import json_schemas

Role: TypeAlias = Literal[
    "joystick",
    "actuators",
    "enabled",
    "object",
    "joystick_alive",
    "alert",
    "prediction",
    "advice",
    "heartbeat",
    "state",
]
OWN: Final[tuple[Role, ...]] = ("alert", "prediction", "heartbeat")
"""What every guard publishes under its base; advice is for those whose site wants it."""

_ROLE, _KEY, _OBJECT = "rampe.role", "rampe.key", "rampe.object"
_ALIVE_SCHEMA = "rampe.joystick_alive.v1"
_ALIVE: Final[dict[str, Any]] = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "$id": "urn:rampe:joystick_alive:v1",
    "title": "JoystickAlive",
    "description": "The liveliness token of the joystick appeared or went; made by the recorder.",
    "type": "object",
    "properties": {"alive": {"type": "boolean", "description": "Whether the token exists."}},
    "required": ["alive"],
}


@dataclass(frozen=True, slots=True)
class Channel:
    """A key of a machine, and what lies on it.

    Attributes:
        role: what it is to a guard.
        key: exact, as the site file says.
        name: of the object whose poses lie there, else empty.
        ros: type of its messages in ROS 2, where they are CDR; else empty.
    """

    role: Role
    key: str
    name: str = ""
    ros: str = ""

    @property
    def schema(self) -> str:
        """Name of the schema of its messages."""
        if self.ros:
            return self.ros
        named = {"object": "object_pose"}
        return f"rampe.{named.get(self.role, self.role)}.v1"

    @property
    def metadata(self) -> dict[str, str]:
        """The same for a file."""
        named = {_OBJECT: self.name} if self.name else {}
        return {_ROLE: self.role, _KEY: self.key, **named}


def channels_of(site: Site) -> tuple[Channel, ...]:
    """All that is recorded of a site's machine; inputs first, the joystick before all."""
    keys = site.keys
    joy, joints = ("", "") if site.ros2 is None else (JOY.name, JOINT_STATE.name)
    found = [
        Channel("joystick", keys.joystick, ros=joy),
        Channel("actuators", keys.actuators, ros=joints),
    ]
    found += [
        Channel("object", item.key, item.name) for item in site.scene.moving if item.key is not None
    ]
    if keys.enabled is not None:
        found.append(Channel("enabled", keys.enabled))
    if keys.joystick_alive is not None:
        found.append(Channel("joystick_alive", keys.joystick_alive))
    found += [Channel(role, f"{keys.base}/{role}") for role in OWN]
    if site.guard.advice.enabled:
        found.append(Channel("advice", f"{keys.base}/advice"))
    return (*found, Channel("state", f"{keys.base}/state"))


def encodings(channel: Channel) -> tuple[str, str]:
    """Of the schema of a channel, and of its messages, as MCAP names them."""
    return ("ros2msg", "cdr") if channel.ros else ("jsonschema", "json")


@cache
def schema_text(name: str) -> bytes:
    """Schema of the messages of a channel: JSON Schema, or a definition of ROS 2."""
    if name in {JOY.name, JOINT_STATE.name}:
        return store().generate_msgdef(name, ros_version=2)[0].encode()
    schema = _ALIVE if name == _ALIVE_SCHEMA else json_schemas()[name]
    return json.dumps(schema, ensure_ascii=False).encode()


def role_of(metadata: Mapping[str, str]) -> str | None:
    """The role that a channel of a file says that it has; None if it says none."""
    return metadata.get(_ROLE)


@dataclass(frozen=True, slots=True)
class Heard:
    """A channel of a file as a site understands it: ``exact`` if put on the very key."""

    channel: Channel
    exact: bool


def understood(site: Site, topic: str, metadata: Mapping[str, str]) -> Heard | None:
    """Which of the site's channels one of a file is; None if it is none of them.

    Args:
        site: with keys of its own.
        topic: of the channel in the file.
        metadata: of the same; a file of another recorder (of ROS 2, say) has none, and is known
            by its topics.
    """
    ours = channels_of(site)
    role = role_of(metadata)
    if role is None:
        topics = _ros_topics(site)
        return next(
            (Heard(c, exact=True) for c in ours if topic in {c.key, topics.get(c.role)}), None
        )
    key, name = metadata.get(_KEY, topic), metadata.get(_OBJECT, "")
    found = [c for c in ours if c.role == role]
    if role == "object":  # by its key, or else by its name: either may have changed
        found = [c for c in found if c.key == key] or [c for c in found if c.name == name]
    return Heard(found[0], exact=topic == key) if found else None


def _ros_topics(site: Site) -> dict[Role, str]:
    """Names that the inputs have in ROS 2, where it is spoken."""
    ros = site.ros2
    return {} if ros is None else {"joystick": ros.joystick_topic, "actuators": ros.actuators_topic}
