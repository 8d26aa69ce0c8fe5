"""``{base}/prediction``: a primitive started, ended, or its forecast changed."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

SCHEMA: Final = "rampe.prediction.v1"


class PredictionSweep(Message, frozen=True, kw_only=True):
    """What the sweep of one forecast proved about one zone."""

    source: f.Source
    zone: Annotated[str, Meta(description="Name of the keep-out object or actuator limit.")]
    certificate: f.Certificate
    contact_fraction: f.Fraction
    link: f.Link
    contact_point_m: f.Point
    clearance_m: f.Clearance
    clearance_now_m: f.ClearanceNow
    probability: Annotated[
        float | None,
        Meta(description="Probability of contact by this forecast, 0 to 1; null: none is known."),
    ]
    time_to_collision_s: f.TimeToCollision


class Endpoint(Message, frozen=True, kw_only=True):
    """One of two futures."""

    position: Annotated[f.ByActuator, Meta(description="End position by actuator [rad or m].")]
    share: Annotated[
        float, Meta(ge=0.0, le=1.0, description="Share of the occurrences that ended there.")
    ]


class Scenario(Message, frozen=True, kw_only=True):
    """One way on from here, as similar situations of the past went on."""

    share: Annotated[
        float, Meta(ge=0.0, le=1.0, description="Weight among all ways: how alike they began.")
    ]
    count: Annotated[int, Meta(description="Similar situations that went on so.")]
    duration_s: Annotated[float, Meta(description="How far ahead it leads [s].")]
    endpoint: Annotated[
        f.ByActuator, Meta(description="Position to which it leads, by actuator [rad or m].")
    ]


class Prediction(Message, frozen=True, kw_only=True):
    """The primitive under way: what is expected of it, and what came of it."""

    schema: Annotated[
        Literal["rampe.prediction.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    boot_id: f.BootId
    seq: f.Seq
    site: f.Site
    machine: f.Machine
    event: Annotated[
        Literal["started", "updated", "ended"], Meta(description="What happened to it.")
    ]
    category: f.Category
    observations: Annotated[int, Meta(description="Primitives of this category learned so far.")]
    mean: Annotated[
        f.ByActuator | None,
        Meta(description="Expected displacement by actuator [rad or m]; null: too few seen."),
    ]
    scale: Annotated[
        f.ByActuator | None,
        Meta(description="Student-t scale by actuator [rad or m]; null: no spread is known."),
    ]
    dof: Annotated[
        f.ByActuator | None, Meta(description="Student-t degrees of freedom by actuator.")
    ]
    start: Annotated[f.ByActuator, Meta(description="Position where it started [rad or m].")]
    endpoint: Annotated[
        f.ByActuator | None, Meta(description="Likeliest end position by actuator [rad or m].")
    ]
    endpoints: Annotated[
        tuple[Endpoint, ...],
        Meta(description="Both ends where two futures were seen from such a start; else empty."),
    ] = ()
    borrowed_from: Annotated[
        tuple[f.Category, ...],
        Meta(description="Related categories that the forecast borrows from."),
    ] = ()
    progress: Annotated[
        f.ByActuator, Meta(description="Displacement so far by actuator [rad or m].")
    ]
    displacement: Annotated[
        f.ByActuator | None,
        Meta(description="Displacement in the end by actuator [rad or m]; null until ended."),
    ]
    learned: Annotated[
        bool | None, Meta(description="Whether it was learned from; null until ended.")
    ]
    not_learned: Annotated[
        str | None, Meta(description="A word for why it was not learned; null if it was.")
    ] = None
    any_path: f.AnyPath
    sweeps: Annotated[
        tuple[PredictionSweep, ...], Meta(description="Results by forecast and zone.")
    ]
    scenarios: Annotated[
        tuple[Scenario, ...],
        Meta(description="Ways on from memory, the likeliest first; empty where it is new here."),
    ] = ()
    stamp: f.Stamp
    published_unix_s: f.Published
