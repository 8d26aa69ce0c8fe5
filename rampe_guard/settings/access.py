"""Access lists: read, and what is wrong with one.

One file that a site edits (`deploy/access.example.yaml`); `programs/access.py` makes a router's
configuration of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

from rampe_guard.settings.access_model import (
    OF_MACHINES,
    AccessModel,
    MachineModel,
    RouterModel,
)
from rampe_guard.settings.explain import validate
from rampe_guard.settings.problems import KeyPath, Problems, did_you_mean, show
from rampe_guard.settings.published import PUBLISHED
from rampe_guard.settings.ros2_keys import MARKERS
from rampe_guard.settings.source import Document, parse, read_bytes


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
    owned = Counter(key for machine in access.machines for _, key in _owned(machine))
    told = {key for machine in access.machines for key in _told(machine)}
    for place, machine in enumerate(access.machines):
        at: KeyPath = ("machines", place)
        for field, key in _owned(machine):
            if owned[key] > 1:
                add((*at, field), f"{show(key)} is there twice", _OWN[field])
        for field, key in _heard(machine):
            if key in told:
                what = f"{show(key)} is a key that a guard publishes or answers on"
                add((*at, field), what, "give another")
        for field, key in _keys(machine):
            if not key.startswith(within):
                what = f"{show(key)} is not below read, {access.read}"
                add((*at, field), what, "rename it, or widen read")
        _check_ros2(machine, at, add)
    _check_nodes(access, add)


_INPUTS = ("joystick", "actuators")
_OWN = {
    **dict.fromkeys(("name", "base", *_INPUTS), "give each machine its own"),
    "ros2": "give each guard its own node, or domain",
}


def _owned(machine: MachineModel) -> Iterable[tuple[str, str]]:
    """What no other machine may have: names and keys, and the field that says each."""
    yield from (("name", machine.name), ("base", machine.base))
    yield from machine.speech.keys.items()
    ros = machine.speech.settings
    if ros is not None and ros.publish:
        yield "ros2", ros.key(ros.markers_topic, MARKERS)


def _told(machine: MachineModel) -> Iterable[str]:
    """Keys on which its guard is believed."""
    yield from (f"{machine.base}/{word}" for word in PUBLISHED)
    if (ros := machine.speech.settings) is not None:
        yield from (ros.key(topic, kind) for topic, kind in ros.published)


def _heard(machine: MachineModel) -> Iterable[tuple[str, str]]:
    """Keys that somebody else than a guard publishes on."""
    yield from machine.speech.keys.items()
    if machine.enabled is not None:
        yield "enabled", machine.enabled
    for key in machine.objects:
        yield "objects", key


def _keys(machine: MachineModel) -> Iterable[tuple[str, str]]:
    """Keys that must lie below read; topics lie where ROS 2 has them."""
    topics = machine.format == "ros2"
    inputs = [name for name in _INPUTS if not topics and not getattr(machine, name).startswith("/")]
    for field in ("base", *inputs, "enabled", "joystick_alive"):
        if (key := getattr(machine, field)) is not None:
            yield field, key
    for key in machine.objects:
        yield "objects", key


def _check_ros2(machine: MachineModel, at: KeyPath, add: _Add) -> None:
    for field, what, remedy in machine.speech.wrongs():
        add((*at, field), what, remedy)
    if machine.format == "json":
        for field in _INPUTS:
            if (said := getattr(machine, field)).startswith("/"):
                what = f"{show(said)} begins with a slash"
                add((*at, field), what, "give a Zenoh key, or write format: ros2 beside a topic")


def _check_nodes(access: AccessModel, add: _Add) -> None:
    spoken = [machine.speech.settings for machine in access.machines]
    guards = {(ros.domain, f"/{ros.node}") for ros in spoken if ros is not None}
    for place, (machine, ros) in enumerate(zip(access.machines, spoken, strict=True)):
        if machine.ros2_nodes and (ros is None or ros.transport != "rmw_zenoh"):
            what = "is given, and only nodes of rmw_zenoh show themselves"
            add(("machines", place, "ros2_nodes"), what, "leave it out")
        for index, node in enumerate(machine.ros2_nodes):
            if ros is not None and (ros.domain, node) in guards:
                what = f"{show(node)} is the node of a guard"
                add(("machines", place, "ros2_nodes", index), what, "name the driver's own node")


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
