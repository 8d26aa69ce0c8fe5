"""Rights of those who speak ROS 2 with a machine, or look on, by the keys of its transport.

Messages go by exact keys, type and hash with them. Tokens of rmw_zenoh hold the id of the session
that declares them, which is another at each start: that part alone is open in a guard's. Nodes,
services, parameters and messages kept for those who come late have no rights here: neither does
the guard need them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, TypeAlias

from rampe_guard.ros2.graph import Voice, driver_tokens
from rampe_guard.settings.access_model import MachineModel
from rampe_guard.settings.ros2_keys import LIVELINESS, Ros2Settings, strangers

Right: TypeAlias = tuple[str, str, tuple[str, ...], tuple[str, ...]]
"""Its name, the flow, kinds of messages, and keys."""
_SUBSCRIBE: Final = ("declare_subscriber",)
_TOKEN: Final = ("liveliness_token",)
_LOOK: Final = ("liveliness_query", "declare_liveliness_subscriber")


def machine_rights(machine: MachineModel) -> Iterator[Right]:
    """Of who publishes the inputs, beyond putting them."""
    if tokens := _of_drivers(machine):
        yield f"machine {machine.name}: is seen in ROS 2", "ingress", _TOKEN, tokens


def guard_rights(machine: MachineModel) -> Iterator[Right]:
    """Of the guard, beyond taking its inputs."""
    ros, who = machine.speech.settings, f"guard {machine.name}"
    if ros is None:
        return
    # what others than its machine may put: by these it tells of a wrong type
    others = tuple(key for one in machine.inputs if (key := strangers(one)) is not None)
    if others:
        yield f"{who}: looks for wrong types", "ingress", _SUBSCRIBE, others
        yield f"{who}: hears of wrong types", "egress", ("put",), others
    if ros.publish:
        yield f"{who}: tells ROS 2", "ingress", ("put",), _published(ros)
    if tokens := _of_guard(ros):
        yield f"{who}: is seen in ROS 2", "ingress", _TOKEN, tokens


def reader_rights(machine: MachineModel) -> Iterator[Right]:
    """Of everybody who may read."""
    ros, who = machine.speech.settings, f"read ROS 2 of {machine.name}"
    if ros is None:
        return
    keys = (*machine.inputs, *_published(ros))
    yield f"{who}: asks for", "ingress", _SUBSCRIBE, keys
    yield f"{who}: gets", "egress", ("put",), keys
    if tokens := (*_of_guard(ros), *_of_drivers(machine)):
        yield f"{who}: looks who is there", "ingress", _LOOK, (f"{LIVELINESS}/{ros.domain}/**",)
        yield f"{who}: sees who is there", "egress", _TOKEN, tokens


def _published(ros: Ros2Settings) -> tuple[str, ...]:
    return tuple(ros.key(topic, kind) for topic, kind in ros.published)


def _of_guard(ros: Ros2Settings) -> tuple[str, ...]:
    """A guard that publishes nothing is no node; the bridge has tokens of its own."""
    return Voice(ros, "*").tokens if ros.publish and ros.transport == "rmw_zenoh" else ()


def _of_drivers(machine: MachineModel) -> tuple[str, ...]:
    return tuple(
        token for node in machine.ros2_nodes for token in driver_tokens(node, machine.inputs)
    )
