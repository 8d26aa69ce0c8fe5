"""Field types that several messages share, each with its description."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

Source = Annotated[
    Literal["stopping", "intent", "next", "contact", "system"],
    Meta(description="The forecast that found it; contact: there already; system: the guard."),
]
Level = Literal["clear", "caution", "warning", "imminent"]
Certificate = Annotated[
    Literal["free", "contact", "unknown"],
    Meta(description="What the sweep proved; unknown is never free."),
]
AnyPath = Annotated[
    Literal["free", "possible", "unknown"] | None,
    Meta(description="Whether any monotone way to the end could touch; null: not asked."),
]
Point = Annotated[
    tuple[float, float, float] | None,
    Meta(
        description="World point of the first contact [m]; null: none, an actuator limit, or the "
        "arm is within the object."
    ),
]
Fraction = Annotated[
    float | None,
    Meta(description="First fraction of the path, 0 to 1, not certified free; null: none."),
]
Clearance = Annotated[
    float | None,
    Meta(
        description="Proven lower bound of the distance along the path less the margin [m] "
        "(actuator limits: actuator unit); 0 in contact, null unknown."
    ),
]
ClearanceNow = Annotated[
    float | None,
    Meta(
        description="The same at the start of the path; negative inside the margin, and no less "
        "than its width in the object."
    ),
]
Probability = Annotated[
    float | None, Meta(description="Probability of contact, 0 to 1; null where none is known.")
]
TimeToCollision = Annotated[
    float | None,
    Meta(description="Time until the first contact [s]; null where none follows."),
]
Category = Annotated[
    tuple[Literal[-1, 0, 1], ...],
    Meta(description="Commanded direction of each actuator, in the site's order."),
]
ByActuator = dict[str, float]
Site = Annotated[str, Meta(description="Name of the site.")]
Machine = Annotated[str, Meta(description="Name of the machine.")]
BootId = Annotated[str, Meta(description="Identifies this run of the guard.")]
Seq = Annotated[
    int,
    Meta(description="Counts the messages on this key since the boot: a gap is a loss."),
]
Stamp = Annotated[
    float | None, Meta(description="Stamp of the newest input used, on the sender's clock [s].")
]
Published = Annotated[float, Meta(description="Unix time of publication [s].")]
Zone = Annotated[str | None, Meta(description="Name of the keep-out object or actuator limit.")]
Link = Annotated[str | None, Meta(description="Link of the arm that touches, or comes nearest.")]
