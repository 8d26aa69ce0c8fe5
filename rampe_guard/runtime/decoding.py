"""How joystick and actuators of a site are read: one function for each, chosen by its format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rampe_guard import wire
from rampe_guard.core.types import FloatArray
from rampe_guard.settings import Site


@dataclass(frozen=True, slots=True)
class Decoders:
    """Payload to message; each raises `MessageError` for what cannot be trusted."""

    joystick: Callable[[bytes], wire.JoystickMessage]
    actuators: Callable[[bytes], wire.ActuatorsMessage]


def limits_said(site: Site) -> FloatArray:
    """Limits of the actuators (n, 2) [unit] as the site file has them, infinite where it has none.

    For viewers that do not load the URDF.
    """
    return np.array(
        [
            (-np.inf if low is None else low, np.inf if high is None else high)
            for low, high in site.arm.limits
        ]
    )


def decoders_of(site: Site, limits: FloatArray) -> Decoders:
    """The decoders of a site.

    Args:
        site: whose format, axes and actuators count.
        limits: of the actuators (n, 2) [unit]; ROS 2 tells joints, whose actuators are sought
            between them.

    Raises:
        SettingsError: the format is ros2, and the extra is not installed.
    """
    axes, names = site.guard.axes, site.actuator_names
    if site.ros2 is None:
        return Decoders(
            lambda payload: wire.decode_joystick(payload, axes),
            lambda payload: wire.decode_actuators(payload, names),
        )
    from rampe_guard.ros2.cdr import store  # noqa: PLC0415 - needs the extra
    from rampe_guard.ros2.inputs import JointReader, decode_joy  # noqa: PLC0415 - the same
    from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY  # noqa: PLC0415 - the same

    for kind in (JOY, JOINT_STATE):  # its code is made now, not with the first message
        store().get_msgdef(kind.name)
    return Decoders(
        lambda payload: decode_joy(payload, axes),
        JointReader(site.arm.joints[: len(names)], limits),
    )
