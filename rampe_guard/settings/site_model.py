"""The site file as pydantic models."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from rampe_guard.core.scene import SelfCollision
from rampe_guard.settings.drive_model import DirectModel, DriveModel
from rampe_guard.settings.model import Model, Name, NonNegative, Number, Pose, Text
from rampe_guard.settings.ros2_model import Ros2Model
from rampe_guard.settings.tuning_model import (
    AdviceModel,
    AlertsModel,
    InputsModel,
    JoystickModel,
    NextModel,
    RampeModel,
    StoppingModel,
    SweepModel,
)

MAX_ACTUATORS = 16
_SELF = SelfCollision()
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"

Endpoint = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]*/\S+$", max_length=1024)]


class TlsModel(Model):
    """Certificates (PEM files, relative to this one) for tls/ and quic/ endpoints."""

    root_ca: Text = Field(description="The certificate authority of the site's routers.")
    certificate: Text | None = Field(
        default=None, description="The certificate that says who we are, for routers that ask."
    )
    key: Text | None = Field(
        default=None,
        description="The private key of the certificate, which only its owner may read.",
    )


class ZenohModel(Model):
    """How the daemon joins the Zenoh network."""

    config: Text | None = Field(
        default=None, description="The Zenoh configuration file (json5), relative to this file."
    )
    mode: Literal["client", "peer"] = Field(
        default="client", description="The mode of the session: client of a router, or peer."
    )
    connect: Annotated[tuple[Endpoint, ...], Field(max_length=32)] | None = Field(
        default=None,
        description=f"The endpoints to connect to, {DEFAULT_ENDPOINT} if left out; with a config "
        "file: the file's own.",
    )
    tls: TlsModel | None = Field(
        default=None, description="The certificates, if an endpoint is tls/ or quic/."
    )
    plain_network: (
        Literal["i accept that anyone on this network can read and forge messages"] | None
    ) = Field(
        default=None,
        description="This very sentence, if messages without certificates may leave the machine.",
    )


class KeysModel(Model):
    """Zenoh keys, exact: no wildcard, no slash at an end."""

    joystick: Text = Field(
        description="The key the joystick is published on; with format ros2 the topic, as in /joy."
    )
    actuators: Text = Field(
        description="The key the actuator positions are published on; with format ros2 the topic, "
        "as in /joint_states."
    )
    base: Text = Field(description="The prefix of every key that the guard publishes.")
    enabled: Text | None = Field(
        default=None,
        description="The key on which the machine says whether it is switched on; left out: it "
        "always is.",
    )


class LimitsModel(Model):
    """Limits of an actuator; one left out comes from the URDF through the drive."""

    lower: Number | None = Field(default=None, description="The smallest position [actuator unit].")
    upper: Number | None = Field(default=None, description="The largest position [actuator unit].")


class ActuatorModel(Model):
    """One actuator: its lever, its joint and how it moves."""

    name: Name = Field(description="The name of the actuator in messages; unique.")
    joint: Text = Field(description="The name of the joint in the URDF that it drives.")
    drive: DriveModel = Field(
        default=DirectModel(type="direct"), description="The map from actuator to joint."
    )
    axis: Annotated[int, Field(ge=0, le=63)] | None = Field(
        default=None,
        description="The index of its joystick axis; its place in this list if left out.",
    )
    sign: Literal[-1, 1] = Field(
        default=1, description="The sign 1 if a positive axis raises the actuator value, else -1."
    )
    unit: Literal["rad", "m"] | None = Field(
        default=None, description="The unit of its position: m for cylinder and four_bar, else rad."
    )
    max_velocity: Annotated[float, Field(gt=0.0, le=1000.0)] = Field(
        description="The top speed [unit/s]."
    )
    max_deceleration: Annotated[float, Field(gt=0.0, le=1e5)] | None = Field(
        default=None, description="The braking [unit/s²]; twice max_velocity if left out."
    )
    lag_s: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.15, description="The time from command to motion [s]."
    )
    deadband: Annotated[float, Field(ge=0.0, lt=1.0)] = Field(
        default=0.05, description="The axis size below which no motion is commanded [-]."
    )
    limits: LimitsModel = Field(
        default=LimitsModel(), description="The limits of its position; from the URDF if left out."
    )


class LinkageModel(Model):
    """A further joint that moves with an actuator."""

    joint: Text = Field(description="The name of the joint in the URDF.")
    actuator: Name = Field(description="The name of the actuator that it follows.")
    drive: DriveModel = Field(
        default=DirectModel(type="direct"), description="The map from actuator to joint."
    )


class ArmModel(Model):
    """The arm: its URDF, where it stands, what drives it."""

    urdf: Text = Field(description="The URDF file, relative to this file.")
    package_dirs: tuple[Text, ...] = Field(
        default=(), description="The folders in which package:// meshes of the URDF are looked up."
    )
    base_pose: Pose = Field(
        default=Pose(), description="The pose of the arm's root link in the world."
    )
    actuators: Annotated[
        tuple[ActuatorModel, ...], Field(min_length=1, max_length=MAX_ACTUATORS)
    ] = Field(description="The actuators, in the order of the arrays on the wire.")
    linkages: tuple[LinkageModel, ...] = Field(
        default=(), description="The further joints that follow an actuator."
    )


class SelfCollisionModel(Model):
    """Whether the arm is swept against itself."""

    enabled: bool = Field(
        default=_SELF.enabled,
        description="True if the links of the arm are swept against each other.",
    )
    margin_m: NonNegative = Field(
        default=_SELF.margin_m,
        description="The keep-out distance between two links of the arm [m].",
    )
    allow: tuple[Annotated[tuple[Text, ...], Field(min_length=2, max_length=2)], ...] = Field(
        default=_SELF.allow,
        description="The pairs of links that may touch; neighbours and pairs that always touch "
        "may in any case.",
    )


class ColumnModel(Model):
    """A column of a log and how its numbers become site units."""

    column: Text = Field(description="The name of the column in the header.")
    scale: Number = Field(
        default=1.0, description="The factor from the column's unit to the site's."
    )
    offset: Number = Field(default=0.0, description="The amount added after scaling [site unit].")


def _column_kind(value: Any) -> str:
    return "column-map" if isinstance(value, dict | ColumnModel) else "column-name"


Column = Annotated[
    Annotated[Text, Tag("column-name")] | Annotated[ColumnModel, Tag("column-map")],
    Discriminator(_column_kind),
]


class LogModel(Model):
    """How the columns of a CSV log become messages."""

    time: Column = Field(description="The column of time; its scale makes it [s].")
    joystick: dict[str, Column] = Field(
        description="The column of each actuator's joystick axis, -1 to 1, by actuator name."
    )
    actuators: dict[str, Column] = Field(
        description="The column of each actuator's position, by actuator name."
    )


class MemoryModel(Model):
    """Whether, where and how often the learned models are kept."""

    enabled: bool = Field(
        default=True, description="True if what is learned is kept over a restart."
    )
    directory: Text | None = Field(
        default=None,
        description="The folder of the kept models, relative to this file; if left out "
        "$STATE_DIRECTORY, else $XDG_STATE_HOME/rampe-guard, else ~/.local/state/rampe-guard.",
    )
    save_every_s: Annotated[float, Field(ge=0.1, le=3600.0)] = Field(
        default=30.0, description="The period of saving while something is learned [s]."
    )


class MetricsModel(Model):
    """Where Prometheus finds the guard."""

    port: Annotated[int, Field(ge=1, le=65535)] = Field(
        description="The TCP port on which /metrics is served."
    )
    host: Text = Field(
        default="127.0.0.1",
        description="The address to listen on; another than this computer's own must be given "
        "in words, since whoever reaches it can read the metrics.",
    )


class FilesModel(Model):
    """Which files may be read beside those in the folder of the site file."""

    allow: Annotated[tuple[Text, ...], Field(max_length=32)] = Field(
        default=(),
        description="The folders, relative to this file, in which scene, URDF, meshes, Zenoh "
        "configuration and certificates may lie too; without it all of them lie below this file's.",
    )


class SiteModel(Model):
    """A machine at a site: its arm, its keys, its scene and how it is guarded."""

    site: Name = Field(description="The name of the site.")
    machine: Name = Field(description="The name of the machine.")
    operator: Name = Field(
        default="operator",
        description="The name of the operator whose way of working is learned; "
        "run --operator overrides it.",
    )
    zenoh: ZenohModel = Field(default=ZenohModel(), description="The Zenoh session.")
    keys: KeysModel = Field(description="The Zenoh keys.")
    format: Literal["json", "ros2"] = Field(
        default="json",
        description="The format of joystick and actuators: json, or ros2 (CDR of sensor_msgs/Joy "
        "and sensor_msgs/JointState).",
    )
    ros2: Ros2Model | None = Field(
        default=None, description="How ROS 2 is spoken, with format ros2; left out: all defaults."
    )
    arm: ArmModel = Field(description="The arm.")
    scene: Text = Field(description="The scene file, relative to this file.")
    files: FilesModel = Field(default=FilesModel(), description="The files that may be read.")
    self_collision: SelfCollisionModel = Field(
        default=SelfCollisionModel(), description="The sweep of the arm against itself."
    )
    inputs: InputsModel = Field(default=InputsModel(), description="The limits of plausible input.")
    joystick: JoystickModel = Field(default=JoystickModel(), description="The joystick processing.")
    rampe: RampeModel = Field(default=RampeModel(), description="The estimator.")
    stopping: StoppingModel = Field(default=StoppingModel(), description="The stopping forecast.")
    next: NextModel = Field(
        default=NextModel(), description="The forecast of what follows, from memory."
    )
    advice: AdviceModel = Field(default=AdviceModel(), description="The speed advice.")
    sweep: SweepModel = Field(default=SweepModel(), description="The certified sweep.")
    alerts: AlertsModel = Field(default=AlertsModel(), description="The alarm logic.")
    memory: MemoryModel = Field(
        default=MemoryModel(), description="The memory of what was learned."
    )
    metrics: MetricsModel | None = Field(
        default=None, description="The metrics for Prometheus; left out, none are served."
    )
    log: LogModel | None = Field(
        default=None, description="The columns of this machine's CSV logs."
    )
