"""The access list of a site as pydantic models."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rampe_guard.settings.model import Model, Name, Text
from rampe_guard.settings.ros2_model import Ros2Model, Speech

Key = Annotated[str, Field(pattern=r"^[^/*$?#\s]+(/[^/*$?#\s]+)*$", max_length=256)]
"""An exact Zenoh key: no wildcard, no slash at an end."""
Input = Annotated[str, Field(pattern=r"^/?[^/*$?#\s]+(/[^/*$?#\s]+)*$", max_length=256)]
"""A key, or a topic of ROS 2, which begins with a slash."""
Node = Annotated[str, Field(pattern=r"^(/[A-Za-z_][A-Za-z0-9_]*)+$", min_length=2, max_length=256)]
"""The full name of a node of ROS 2."""

Role = Literal["machine", "object", "guard", "recorder", "viewer", "operator", "engineer", "router"]
OF_MACHINES = ("machine", "guard")
"""Roles that must say of which machines: nobody is the guard of all of them by default."""


class RouterModel(Model):
    """How the router is reached."""

    listen: Annotated[tuple[Text, ...], Field(min_length=1, max_length=8)] = Field(
        default=("tls/0.0.0.0:7447",),
        description="The TLS endpoints to listen on, such as tls/0.0.0.0:7447.",
    )
    connect: tuple[Text, ...] = Field(
        default=(), description="The TLS endpoints of other routers of the site."
    )
    certificates: Text = Field(
        description="The folder with ca.crt, tls.crt and tls.key, as the router sees it."
    )
    plain_loopback_port: Annotated[int, Field(ge=1, le=65535)] | None = Field(
        default=None,
        description="The port on 127.0.0.1 on which every process of the router's own host may do "
        "everything, without TLS; left out: none.",
    )


class MachineModel(Model):
    """A machine: the keys that its site file and its scene file name."""

    name: Name = Field(description="The name of the machine; unique.")
    base: Key = Field(description="The prefix of every key that its guard publishes.")
    format: Literal["json", "ros2"] = Field(
        default="json", description="The format of joystick and actuators, as in the site file."
    )
    ros2: Ros2Model | None = Field(
        default=None,
        description="How ROS 2 is spoken, with format ros2: the block of the site file.",
    )
    ros2_nodes: tuple[Node, ...] = Field(
        default=(),
        description="The full names of the nodes that publish joystick and actuators, as in "
        "/joy_node, if tools of ROS 2 shall see them; for rmw_zenoh.",
    )
    joystick: Input = Field(
        description="The key the joystick is published on; with format ros2 the topic, as in /joy."
    )
    actuators: Input = Field(
        description="The key the actuator positions are published on; with format ros2 the topic."
    )
    enabled: Key | None = Field(
        default=None, description="The key on which it says whether it is switched on."
    )
    joystick_alive: Key | None = Field(
        default=None, description="The key of the joystick's liveliness token."
    )
    objects: tuple[Key, ...] = Field(
        default=(), description="The keys of the poses that its guard reads."
    )
    max_rate_hz: Annotated[float, Field(ge=1.0, le=100_000.0)] | None = Field(
        default=2000.0,
        description="The most that the router lets through on each input of it [1/s]; of what "
        "comes at once the first goes through. null: all, for senders that publish on change.",
    )

    @property
    def speech(self) -> Speech:
        """How it speaks."""
        said = {"joystick": self.joystick, "actuators": self.actuators}
        return Speech(self.format, self.ros2, said)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Joystick and actuators as Zenoh keys."""
        return tuple(self.speech.keys.values())


class GrantModel(Model):
    """What the bearer of a certificate may do; several of one certificate add up."""

    certificate: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")] = Field(
        description="The common name of the certificate."
    )
    role: Role = Field(description="The role.")
    machines: Annotated[tuple[Name, ...], Field(min_length=1)] | None = Field(
        default=None,
        description="The machines that it is for; left out: all (machine and guard must say).",
    )
    keys: Annotated[tuple[Key, ...], Field(min_length=1)] | None = Field(
        default=None, description="The keys that an object publishes its poses on."
    )


class AccessModel(Model):
    """The access list."""

    router: RouterModel = Field(description="The router.")
    read: Annotated[str, Field(pattern=r"^[^/*$?#\s]+(/[^/*$?#\s]+)*/\*\*$")] = Field(
        default="rampe/**",
        description="The keys that everyone with a reading role may read, ending with /**; all "
        "keys of all machines lie below it.",
    )
    machines: Annotated[tuple[MachineModel, ...], Field(min_length=1)] = Field(
        description="The machines."
    )
    access: Annotated[tuple[GrantModel, ...], Field(min_length=1)] = Field(
        description="The certificates and their roles."
    )
