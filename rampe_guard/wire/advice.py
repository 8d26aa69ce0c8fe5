"""``{base}/advice``: how much each actuator may be commanded."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

SCHEMA: Final = "rampe.advice.v1"

Share = Annotated[float, Meta(ge=0.0, le=1.0)]


class ActuatorAdvice(Message, frozen=True, kw_only=True):
    """The largest commands of one actuator, as shares of its top speed."""

    negative_share: Annotated[
        Share,
        Meta(description="Towards smaller values of the actuator; 1 is free, 0 is not at all."),
    ]
    positive_share: Annotated[Share, Meta(description="Towards larger values of the actuator.")]
    negative_zone: Annotated[
        str | None, Meta(description="What limits `negative_share`; null: nothing.")
    ]
    positive_zone: Annotated[
        str | None, Meta(description="What limits `positive_share`; null: nothing.")
    ]


class Advice(Message, frozen=True, kw_only=True):
    """With commands within these shares the arm can stop short of every zone.

    Advisory only: no safety function. Shares are of the actuators' directions, after `sign` of
    the site file. They hold for the levers that are out now together, for all others each alone.
    """

    schema: Annotated[
        Literal["rampe.advice.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    boot_id: f.BootId
    seq: f.Seq
    site: f.Site
    machine: f.Machine
    quality: Annotated[
        Literal["good", "degraded", "none"],
        Meta(description="none: there is no advice now, which is not the same as free."),
    ]
    actuators: Annotated[
        dict[str, ActuatorAdvice] | None,
        Meta(description="By actuator; null while nobody can tell."),
    ]
    reason: Annotated[str | None, Meta(description="Why there is none; null: there is advice.")]
    stamp: f.Stamp
    published_unix_s: f.Published
    expires_after_s: Annotated[
        float, Meta(description="Age at which it must no longer be followed, nor read as free [s].")
    ]
    text: Annotated[str, Meta(description="For a cab display, at most 60 characters.")]
