"""ROS 2 traffic, byte for byte, without ROS: what drivers publish."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from rampe_guard.core.drive import joint_scalar
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.attachment import Attachment
from rampe_guard.ros2.graph import gid_of
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import DIAGNOSTICS, JOINT_STATE, JOY, MARKERS
from tests.support.processes import BENCH

GID = gid_of("a driver")
LIMITS = np.array([[-3.2, 3.2], [0.0, 0.118], [0.0, 0.145], [0.0, 0.11]])
"""Of the bench machine's actuators."""


def joy(axes: Sequence[float], stamp_s: float = 0.0, buttons: Sequence[int] = (0, 1)) -> bytes:
    message = cdr.make(
        "sensor_msgs/msg/Joy",
        header=cdr.header(stamp_s, "joy"),
        axes=np.array(axes, np.float32),
        buttons=np.array(buttons, np.int32),
    )
    return cdr.encode(message, JOY)


def joint_state(
    angles: Mapping[str, float],
    stamp_s: float = 0.0,
    speeds: Mapping[str, float] | None = None,
    names: Sequence[str] | None = None,
) -> bytes:
    """Joints in the order of ``names``, which may also lie."""
    order = list(angles if names is None else names)
    told = [] if speeds is None else [speeds.get(name, float("nan")) for name in order]
    message = cdr.make(
        "sensor_msgs/msg/JointState",
        header=cdr.header(stamp_s, "base_link"),
        name=order,
        position=np.array([angles.get(name, 0.0) for name in order]),
        velocity=np.array(told, dtype=float),
        effort=np.array([], dtype=float),
    )
    return cdr.encode(message, JOINT_STATE)


def angles_of(site: Site, position: Sequence[float]) -> dict[str, float]:
    """Where the joints are at actuator values, the last first, among others."""
    drives = site.arm.joints[: len(position)]
    own = {d.joint: joint_scalar(d.drive, float(q)) for d, q in zip(drives, position, strict=True)}
    return {"mast_joint": 0.25, **dict(reversed(own.items())), "camera_joint": float("nan")}


def bench_in_ros2(folder: Path, transport: str = "rmw_zenoh", more: str = "") -> Path:
    """The site file of the bench machine, with topics instead of keys."""
    text = BENCH.read_text("utf-8")
    text = text.replace("rampe/bench/excavator/joystick", "/joy")
    text = text.replace("rampe/bench/excavator/actuators", "/excavator/joint_states")
    text = text.replace("../../geometry", str(BENCH.parents[2] / "geometry"))
    text = text.replace("../scenes", str(BENCH.parents[1] / "scenes"))
    path = folder / f"bench-{transport}.yaml"
    path.write_text(f"{text}\nformat: ros2\nros2: {{transport: {transport}{more}}}\n", "utf-8")
    return path


@dataclass
class RosEars:
    """Diagnostics or markers: key, attachment, and what the bytes say."""

    heard: list[tuple[str, bytes | None, Any]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def all(self) -> list[tuple[str, bytes | None, Any]]:
        with self.lock:
            return list(self.heard)

    def hear(self, sample: zenoh.Sample) -> None:
        kind = DIAGNOSTICS if "diagnostics" in str(sample.key_expr) else MARKERS
        attached = None if sample.attachment is None else sample.attachment.to_bytes()
        said = cdr.decode(sample.payload.to_bytes(), kind, 4_000_000)
        with self.lock:
            self.heard.append((str(sample.key_expr), attached, said))


class Sender:
    """Numbers messages of one topic as rmw_zenoh does."""

    def __init__(self, gid: bytes = GID) -> None:
        self._gid, self.sequence = gid, 0

    def attachment(self) -> bytes:
        self.sequence += 1
        return Attachment(self.sequence, time.time_ns(), self._gid).packed()
