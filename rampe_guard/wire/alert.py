"""``{base}/alert``: one alert, at each transition and while it is active."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.core.alarm import Level, urgency
from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

SCHEMA: Final = "rampe.alert.v1"


class Alert(Message, frozen=True, kw_only=True):
    """One alert of one zone: the worst link and level of it."""

    schema: Annotated[
        Literal["rampe.alert.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    alert_id: Annotated[
        str,
        Meta(description="Identifies the alert from its rise to its end; for `ack`, `shelve`."),
    ]
    boot_id: f.BootId
    seq: f.Seq
    site: f.Site
    machine: f.Machine
    source: f.Source
    level: Annotated[f.Level, Meta(description="How urgent it is.")]
    previous_level: Annotated[f.Level, Meta(description="The level before the last change.")]
    state: Annotated[
        Literal["normal", "unacked", "acked", "rtn_unacked"],
        Meta(description="Life cycle by ISA-18.2; rtn_unacked: cause gone, not yet seen."),
    ]
    inhibit: Annotated[
        Literal["none", "shelved", "machine_off"],
        Meta(
            description="Why nobody is to be troubled with it. shelved: silent for a time; "
            "machine_off: the machine is switched off, and nothing is watched."
        ),
    ]
    quality: Annotated[
        Literal["good", "degraded", "stale"],
        Meta(description="Trust in the inputs; stale: the alert is frozen."),
    ]
    zone: f.Zone
    link: f.Link
    probability: Annotated[
        float | None,
        Meta(
            description="Calibrated probability of contact within the horizon (next.horizon_s in"
            " the site file), 0 to 1, of all forecasts together; null where none is known."
        ),
    ]
    time_to_collision_s: f.TimeToCollision
    clearance_m: f.Clearance
    clearance_now_m: f.ClearanceNow
    contact_point_m: f.Point
    contact_fraction: f.Fraction
    any_path: f.AnyPath
    category: Annotated[
        tuple[Literal[-1, 0, 1], ...] | None,
        Meta(description="Commanded direction of each actuator; null between primitives."),
    ]
    observations: Annotated[
        int | None, Meta(description="Primitives of this category learned so far.")
    ]
    predicted_displacement: Annotated[
        f.ByActuator | None, Meta(description="Expected displacement by actuator [rad or m].")
    ]
    predicted_endpoint: Annotated[
        f.ByActuator | None,
        Meta(
            description="Expected end position by actuator [rad or m]; of source next: where the"
            " likeliest of the similar situations that touched leads."
        ),
    ]
    similar_situations: Annotated[
        int | None,
        Meta(
            description="Similar situations of the past that were asked; null where memory does"
            " not speak (any source but next)."
        ),
    ] = None
    similar_contacts: Annotated[
        int | None,
        Meta(description="Those of them that went on to touch the zone; null as above."),
    ] = None
    stamp: f.Stamp
    published_unix_s: f.Published
    uptime_s: Annotated[
        float | None,
        Meta(
            description="Time since the boot at publication [s], as in the heartbeat: shows who"
            " compares it with its arrival that it came late; null offline."
        ),
    ] = None
    input_age_s: Annotated[
        float | None, Meta(description="Age of the newest input at publication [s].")
    ]
    compute_ms: Annotated[
        float | None, Meta(description="Time from taking the inputs to this alert [ms].")
    ]
    raised_unix_s: Annotated[
        float | None, Meta(description="Unix time at which it left normal [s].")
    ]
    changed_unix_s: Annotated[
        float | None, Meta(description="Unix time of its last change of level or state [s].")
    ]
    acked_by: Annotated[str | None, Meta(description="Who acknowledged it.")]
    shelved_by: Annotated[
        str | None, Meta(description="Who shelved it; null unless it is shelved.")
    ] = None
    shelved_until_unix_s: Annotated[
        float | None, Meta(description="Unix time at which it will ask again [s]; null as above.")
    ] = None
    expires_after_s: Annotated[
        float, Meta(description="Age at which it must no longer be trusted [s].")
    ]
    text: Annotated[
        str,
        Meta(
            description="For a cab display: link, zone and time, on at most 60 cells.",
            extra_json_schema={"maxLength": 60},
        ),
    ]


def by_urgency(alerts: Iterable[Alert]) -> tuple[Alert, ...]:
    """The gravest first, then the soonest, then by name: the order of every list of alerts."""
    return tuple(
        sorted(
            alerts,
            key=lambda a: (
                *urgency(Level[a.level.upper()], a.time_to_collision_s),
                a.zone or "",
            ),
        )
    )
