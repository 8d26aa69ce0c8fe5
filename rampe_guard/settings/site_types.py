"""A site as plain frozen values: all that a machine's guard is built from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from rampe_guard.core.arm import ArmDescription
from rampe_guard.core.config import GuardConfig, SweepConfig
from rampe_guard.core.scene import Scene, SelfCollision
from rampe_guard.folders import Folders
from rampe_guard.settings.published import PUBLISHED
from rampe_guard.settings.ros2_keys import Ros2Settings


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Paths of PEM files; certificate and key are both there, or neither.

    Attributes:
        said: where each of them is named: root_ca, certificate, key; for messages.
    """

    root_ca: str
    certificate: str | None = None
    key: str | None = None
    said: tuple[str, str, str] = ("zenoh.tls.root_ca", "zenoh.tls.certificate", "zenoh.tls.key")


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """How to join the network.

    Attributes:
        config: path of a Zenoh file, which then alone configures the session, or None.
        mode: "client" or "peer"; holds only without ``config``.
        connect: endpoints; holds only without ``config``.
        tls: certificates for tls/ and quic/ endpoints; holds only without ``config``.
        plain_network: messages without certificates may leave the machine.
    """

    config: str | None
    mode: Literal["client", "peer"]
    connect: tuple[str, ...]
    tls: TlsFiles | None = None
    plain_network: bool = False


@dataclass(frozen=True, slots=True)
class Keys:
    """Exact Zenoh keys; ``base`` is the prefix of all that the guard publishes."""

    joystick: str
    actuators: str
    base: str
    joystick_alive: str | None
    enabled: str | None = None

    def used(self) -> dict[str, str]:
        """Every key that means something at the site, and what."""
        used = {f"{self.base}/{word}": "a key of the guard itself" for word in PUBLISHED}
        for name in ("joystick", "actuators", "base", "enabled"):
            if (key := getattr(self, name)) is not None:
                used[key] = f"keys.{name}"
        if self.joystick_alive is not None:
            used[self.joystick_alive] = "inputs.joystick.alive_key"
        return used


@dataclass(frozen=True, slots=True)
class ColumnMap:
    """Site value = scale·(value in ``column``) + offset."""

    column: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class LogMapping:
    """Columns of a CSV log: time [s], axis [-1, 1] and position [unit] by actuator name."""

    time: ColumnMap
    joystick: Mapping[str, ColumnMap]
    actuators: Mapping[str, ColumnMap]


@dataclass(frozen=True, slots=True)
class MemorySettings:
    """How what was learned outlives a restart.

    Attributes:
        enabled: whether it does.
        directory: absolute path of the folder of all models, None for the system's usual one.
        save_every_s: period of saving while something is learned [s].
    """

    enabled: bool = True
    directory: str | None = None
    save_every_s: float = 30.0


@dataclass(frozen=True, slots=True)
class MetricsSettings:
    """Where Prometheus finds the guard: a host that we listen on, and a TCP port."""

    host: str
    port: int


@dataclass(frozen=True, slots=True)
class Site:
    """A machine at a site.

    Attributes:
        name: of the site.
        machine: name of the machine.
        zenoh: how to join the network.
        keys: what to subscribe to and publish on.
        format: of joystick and actuators.
        arm: URDF, pose, drives and limits.
        guard: actuators and settings of the core.
        sweep: tolerances and budget.
        scene: keep-out zones.
        log: columns of CSV logs, None if the file names none.
        path: absolute path of the site file.
        content_hash: SHA-256 (hex) of the site file followed by the URDF.
        package_dirs: where package:// meshes of the URDF are looked up.
        operator: whose way of working is learned.
        memory: how it is kept.
        self_collision: whether the arm is swept against itself.
        folders: where its files may lie; None for one that was not read from a file.
        metrics: where metrics are served, None if they are not.
        ros2: how ROS 2 is spoken; None where the format is another.
    """

    name: str
    machine: str
    zenoh: ZenohSettings
    keys: Keys
    format: Literal["json", "ros2"]
    arm: ArmDescription
    guard: GuardConfig
    sweep: SweepConfig
    scene: Scene
    log: LogMapping | None
    path: str
    content_hash: str
    package_dirs: tuple[str, ...] = ()
    operator: str = "operator"
    memory: MemorySettings = MemorySettings()
    self_collision: SelfCollision = field(default_factory=SelfCollision)
    folders: Folders | None = None
    metrics: MetricsSettings | None = None
    ros2: Ros2Settings | None = None

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Names in the order of the arrays on the wire."""
        return tuple(a.name for a in self.guard.actuators)
