"""What was asked of ``rampe-guard init``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

from rampe_guard.settings.ros2_keys import Transport


def key_part(name: str) -> str:
    """A name as a part of a key."""
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in name)


@dataclass(frozen=True, slots=True)
class Wishes:
    """What was asked for.

    Attributes:
        urdf: of the arm.
        out: folder for what is written.
        site, machine: names.
        log: recording to measure from.
        time: column of time, for a CSV log.
        connect: endpoints to listen on.
        zenoh: Zenoh configuration file instead.
        plain_network: messages without certificates may leave the machine.
        format: of the messages, json or ros2; None: what the recording is, else json.
        transport: what lies between ROS 2 and Zenoh.
        domain: ROS_DOMAIN_ID.
        type_hash: keys of rmw_zenoh end with the hash of the type.
        joystick, actuators: keys; topics of ROS 2; for a CSV log columns, with commas.
        seconds: for how long to listen [s].
        joints: of the positions, in their order.
        names: of the actuators, in the same order.
        cylinders: NAME=BASE,ROD,LENGTH[,ANGLE[,DIRECTION]].
        package_dirs: where package:// meshes are looked for.
        force: overwrite.
    """

    urdf: str
    out: str
    site: str = "my-site"
    machine: str = ""
    log: str | None = None
    time: str | None = None
    connect: tuple[str, ...] = ()
    zenoh: str | None = None
    plain_network: bool = False
    format: str | None = None
    transport: Transport | None = None
    domain: int | None = None
    type_hash: bool = True
    joystick: str | None = None
    actuators: str | None = None
    seconds: float = 60.0
    joints: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    cylinders: tuple[str, ...] = ()
    package_dirs: tuple[str, ...] = ()
    force: bool = False

    @property
    def live(self) -> bool:
        """The machine itself is listened to."""
        return self.log is None and (bool(self.connect) or self.zenoh is not None)

    @property
    def base(self) -> str:
        """What the keys of this machine begin with."""
        return f"rampe/{key_part(self.site)}/{key_part(self.machine)}"

    @classmethod
    def of(cls, args: Mapping[str, Any]) -> Self:
        """From the options of the command line, by their names."""
        given = {one.name: args[one.name] for one in fields(cls)}
        lists = {name: tuple(value) for name, value in given.items() if isinstance(value, list)}
        return cls(**{**given, **lists})
