"""``{base}/heartbeat``: that the worker loop runs, and how well."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

SCHEMA: Final = "rampe.heartbeat.v1"


class Reason(Message, frozen=True, kw_only=True):
    """Why the status is not ok."""

    code: Annotated[str, Meta(description="A word fit for a rule, such as joystick_silent.")]
    text: Annotated[str, Meta(description="The same for people.")]
    key: Annotated[
        str | None, Meta(description="The Zenoh key that is silent or wrong, if one is.")
    ] = None


class InputAges(Message, frozen=True, kw_only=True):
    """Ages of the newest accepted inputs; null before the first."""

    joystick_s: Annotated[float | None, Meta(description="Age of the joystick's [s].")]
    actuators_s: Annotated[float | None, Meta(description="Age of the actuators' [s].")]


class InputRates(Message, frozen=True, kw_only=True):
    """Accepted messages per second."""

    joystick: Annotated[float | None, Meta(description="Joystick messages [1/s].")]
    actuators: Annotated[float | None, Meta(description="Actuator messages [1/s].")]


class Quantiles(Message, frozen=True, kw_only=True):
    """Quantiles of a duration over the last seconds."""

    p50: Annotated[float, Meta(description="Median [ms].")]
    p99: Annotated[float, Meta(description="99th percentile [ms].")]


class ObjectInput(Message, frozen=True, kw_only=True):
    """The poses of one object that moves."""

    name: Annotated[str, Meta(description="Name of its zone.")]
    key: Annotated[str, Meta(description="The Zenoh key of its poses.")]
    placed: Annotated[
        bool, Meta(description="Whether it is known where it is; else it is taken as contact.")
    ]
    age_s: Annotated[
        float | None, Meta(description="Age of the newest accepted pose [s]; null before it.")
    ]
    grown_m: Annotated[
        float | None,
        Meta(description="How far it may have moved since [m]; null where it is not placed."),
    ]
    rate_hz: Annotated[float | None, Meta(description="Accepted poses [1/s].")]
    accepted: Annotated[int, Meta(description="Poses accepted since the boot.")]
    rejected: Annotated[
        dict[str, int], Meta(description="Messages refused since the boot, by reason.")
    ]


class CanaryTrial(Message, frozen=True, kw_only=True):
    """The newest trial of the sweep and of FCL with motions whose answers are known."""

    result: Annotated[
        Literal["ok", "failed"],
        Meta(description="failed: this machine computes what is not so, and is not monitoring."),
    ]
    age_s: Annotated[float, Meta(description="Age of the newest trial [s].")]


class Remembered(Message, frozen=True, kw_only=True):
    """What is remembered of how situations went on."""

    situations: Annotated[int, Meta(description="Situations remembered.")]
    work_s: Annotated[float, Meta(description="Time of work that they span [s].")]


class Learned(Message, frozen=True, kw_only=True):
    """What is learned of the operator's primitives."""

    categories: Annotated[int, Meta(description="Categories of primitives met.")]
    occurrences: Annotated[int, Meta(description="Primitives learned, earlier runs' too.")]


class Resources(Message, frozen=True, kw_only=True):
    """What the guard's process takes of its computer."""

    rss_bytes: Annotated[int, Meta(description="Memory that it occupies [bytes].")]
    cpu_s: Annotated[float, Meta(description="Processor time since it started [s].")]


class Commands(Message, frozen=True, kw_only=True):
    """What people wanted of the guard since the boot, by command."""

    granted: Annotated[dict[str, int], Meta(description="Done, by command.")]
    refused: Annotated[dict[str, int], Meta(description="Refused, by command.")]


class Heartbeat(Message, frozen=True, kw_only=True):
    """Health of the guard, sent from its worker loop."""

    schema: Annotated[
        Literal["rampe.heartbeat.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    boot_id: f.BootId
    seq: f.Seq
    site: f.Site
    machine: f.Machine
    status: Annotated[
        Literal["ok", "degraded", "not_monitoring"],
        Meta(
            description="Whether the machine is guarded; not_monitoring: it is not, which is no "
            "fault if machine_off is the only reason."
        ),
    ]
    reasons: Annotated[
        tuple[Reason, ...], Meta(description="Why not ok, the gravest first; empty when ok.")
    ]
    input_age_s: Annotated[InputAges, Meta(description="Ages of the inputs.")]
    rates_hz: Annotated[InputRates, Meta(description="Rates of the inputs.")]
    accepted: Annotated[
        dict[str, int], Meta(description="Messages accepted since the boot, by input.")
    ]
    rejected: Annotated[
        dict[str, dict[str, int]],
        Meta(description="Messages refused since the boot, by input, then reason."),
    ]
    objects: Annotated[
        tuple[ObjectInput, ...], Meta(description="Objects that move, in the order of the scene.")
    ] = ()
    canary: Annotated[
        CanaryTrial | None, Meta(description="Does the machine compute what is so? null untried.")
    ] = None
    primitives: Annotated[
        dict[str, int],
        Meta(description="Finished primitives since the boot: learned, or by why they were not."),
    ]
    memory: Annotated[
        Remembered | None, Meta(description="The memory of situations; null if it is unknown.")
    ] = None
    drops: Annotated[
        int | None,
        Meta(
            description="How often a queue of inputs was found full since the boot, and has lost "
            "messages; null unknown. What was not looked at is refused as overload."
        ),
    ]
    alerts: Annotated[
        dict[str, int] | None,
        Meta(description="Alerts that are active or wait for a person, by level; null unknown."),
    ] = None
    learned: Annotated[
        Learned | None, Meta(description="The learned primitives; null if it is unknown.")
    ] = None
    save_failures: Annotated[
        int | None,
        Meta(description="Saves of what is learned that failed since the boot; null unknown."),
    ] = None
    router: Annotated[
        bool | None, Meta(description="Whether a Zenoh router was there; null unknown.")
    ] = None
    resources: Annotated[
        Resources | None, Meta(description="Memory and processor time; null unknown.")
    ] = None
    commands: Annotated[
        Commands | None, Meta(description="What people wanted of it; null unknown.")
    ] = None
    steps: Annotated[
        int | None, Meta(description="Steps from a new position since the boot; null unknown.")
    ] = None
    loop_ms: Annotated[
        Quantiles | None, Meta(description="Times of the worker loop; null before the first.")
    ]
    sweep_ms: Annotated[
        Quantiles | None, Meta(description="Times of a sweep; null before the first.")
    ]
    tick: Annotated[int, Meta(description="Runs of the worker loop since the boot.")]
    scene_hash: Annotated[str, Meta(description="SHA-256 of the scene in force.")]
    config_hash: Annotated[str, Meta(description="SHA-256 of the site file and URDF.")]
    version: Annotated[str, Meta(description="Version of rampe-guard.")]
    published_unix_s: f.Published
    uptime_s: Annotated[float, Meta(description="Time since the boot [s].")]
