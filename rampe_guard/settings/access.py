"""The access list of a site: its machines, its routers, and which certificate may do what.

One file that a site edits (`deploy/access.example.yaml`); `programs/access.py` makes a router's
configuration of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Annotated, Literal

from pydantic import Field

from rampe_guard.settings.explain import validate
from rampe_guard.settings.model import Model, Name, Text
from rampe_guard.settings.problems import KeyPath, Problems, did_you_mean, show
from rampe_guard.settings.source import Document, parse, read_bytes

Key = Annotated[str, Field(pattern=r"^[^/*$?#\s]+(/[^/*$?#\s]+)*$", max_length=256)]
"""An exact Zenoh key: no wildcard, no slash at an end."""

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
    joystick: Key = Field(description="The key the joystick is published on.")
    actuators: Key = Field(description="The key the actuator positions are published on.")
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


def read_access(path: str) -> AccessModel:
    """Read an access list.

    Raises:
        SettingsError: with line, key and remedy of every problem.
    """
    return check_access(parse(read_bytes(path, "access list"), path))


def check_access(document: Document) -> AccessModel:
    """The access list that ``document`` is.

    Raises:
        SettingsError: every problem of it.
    """
    access = validate(AccessModel, document)
    problems = Problems(document)
    _check_endpoints(access.router, problems.add)
    _check_machines(access, problems.add)
    _check_grants(access, problems.add)
    problems.raise_if_any()
    return access


_Add = Callable[[KeyPath, str, str], None]


def _check_endpoints(router: RouterModel, add: _Add) -> None:
    for field in ("listen", "connect"):
        for place, endpoint in enumerate(getattr(router, field)):
            if not endpoint.startswith(("tls/", "quic/")):
                add(
                    ("router", field, place),
                    f"{show(endpoint)} is not encrypted",
                    "give tls/HOST:PORT; plain_loopback_port is for this host",
                )


def _check_machines(access: AccessModel, add: _Add) -> None:
    within = access.read.removesuffix("**")
    owned = Counter(
        key
        for machine in access.machines
        for key in (machine.name, machine.base, machine.joystick, machine.actuators)
    )
    for place, machine in enumerate(access.machines):
        for field in ("name", "base", "joystick", "actuators"):
            if owned[value := getattr(machine, field)] > 1:
                what = f"{show(value)} is there twice"
                add(("machines", place, field), what, "give each machine its own")
        for field, key in _keys(machine):
            if not key.startswith(within):
                what = f"{show(key)} is not below read, {access.read}"
                add(("machines", place, field), what, "rename it, or widen read")


def _keys(machine: MachineModel) -> Iterable[tuple[str, str]]:
    for field in ("base", "joystick", "actuators", "enabled", "joystick_alive"):
        if (key := getattr(machine, field)) is not None:
            yield field, key
    for key in machine.objects:
        yield "objects", key


def _check_grants(access: AccessModel, add: _Add) -> None:
    names = [machine.name for machine in access.machines]
    objects = {key for machine in access.machines for key in machine.objects}
    for place, grant in enumerate(access.access):
        at: KeyPath = ("access", place)
        for index, name in enumerate(grant.machines or ()):
            if name not in names:
                what = f"no machine is named {show(name)}"
                add((*at, "machines", index), what, did_you_mean(name, names))
        if grant.role in OF_MACHINES and grant.machines is None:
            what = f"{grant.role} of which machines is not said"
            add((*at, "role"), what, "add machines: [NAME]")
        if (grant.role == "object") is (grant.keys is None):
            what = "needs the keys of its poses" if grant.keys is None else "cannot have keys"
            add((*at, "role"), f"{grant.role} {what}", "keys belong to role object, and only there")
        for index, key in enumerate(grant.keys or ()):
            if key not in objects:
                what = f"no machine reads {show(key)}"
                add((*at, "keys", index), what, did_you_mean(key, sorted(objects)))
