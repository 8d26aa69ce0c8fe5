"""``report.json``: every figure of an evaluation, as structs; its JSON Schema comes from them."""

from __future__ import annotations

from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta

SCHEMA: Final = "rampe.evaluation.v1"

Share = Annotated[float | None, Meta(description="Share of all crossings; null without any.")]
Seconds = Annotated[float | None, Meta(description="[s]; null where no crossing was warned of.")]
Interval = Annotated[
    tuple[float, float] | None,
    Meta(description="95 % bootstrap interval (blocks of half a minute); null: not reckoned."),
]

Leads = Annotated[
    tuple[float | None, ...],
    Meta(
        description="Lead time of every crossing that came while the guard monitored, by log, zone"
        " and time [s]; null: missed."
    ),
]


class Part(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all parts."""


class Intervals(Part, frozen=True, kw_only=True):
    """95 % bootstrap intervals of the figures of a point."""

    false_per_min_per_zone: Interval
    warned_0_5_s: Interval
    warned_1_0_s: Interval
    warned_1_5_s: Interval
    warned_2_0_s: Interval
    missed: Interval
    median_lead_s: Interval
    lead_5_percent_s: Interval


class Strict(Part, frozen=True, kw_only=True):
    """The figures of alarms that end with their last cause: none earns credit by staying on."""

    false_per_min_per_zone: Annotated[
        float | None, Meta(description="False alarms per minute and zone [1/min].")
    ]
    alarmed_share: Annotated[
        float | None, Meta(description="Share of the time outside contact that an alarm was on.")
    ]
    warned_0_5_s: Share
    warned_1_0_s: Share
    warned_1_5_s: Share
    warned_2_0_s: Share
    median_lead_s: Seconds
    missed: Annotated[int, Meta(description="Crossings without any alarm before them.")]


class Point(Part, frozen=True, kw_only=True):
    """A forecaster at one threshold: what it is good for, and what it costs."""

    threshold: Annotated[
        float | None,
        Meta(
            description="Least score that alarms, or the parameter of a trade-off; null where"
            " there is none to set."
        ),
    ]
    false_per_min_per_zone: Annotated[
        float | None, Meta(description="False alarms per minute and zone [1/min].")
    ]
    alarmed_share: Annotated[
        float | None,
        Meta(
            description="Share of the time outside contact that an alarm was on: an alarm that"
            " hardly ends is seldom false, and says little."
        ),
    ]
    warned_0_5_s: Share
    warned_1_0_s: Share
    warned_1_5_s: Share
    warned_2_0_s: Share
    median_lead_s: Seconds
    lead_5_percent_s: Annotated[
        float | None, Meta(description="95 % of the warned crossings have at least this [s].")
    ]
    crossings: Annotated[
        int,
        Meta(description="Contacts of the motion that really happened, while the guard monitored."),
    ]
    unmonitored: Annotated[
        int,
        Meta(
            description="Contacts while the guard said NOT MONITORING: neither warned of nor"
            " missed, and in no other figure."
        ),
    ]
    missed: Annotated[int, Meta(description="Crossings without any alarm before them.")]
    alarms: Annotated[int, Meta(description="Alarm episodes.")]
    false_alarms: Annotated[int, Meta(description="Alarms without a crossing.")]
    undecided: Annotated[
        int, Meta(description="Alarms that the end of a log kept from being true or false.")
    ]
    zone_minutes: Annotated[
        float, Meta(description="Time in which the guard monitored, summed over zones [min].")
    ]
    strict: Annotated[
        Strict | None,
        Meta(description="With alarms that end with their last cause; null of published alerts."),
    ] = None
    intervals: Annotated[
        Intervals | None, Meta(description="Null at points for which none were reckoned.")
    ] = None


class Forecast(Part, frozen=True, kw_only=True):
    """A forecaster."""

    description: Annotated[str, Meta(description="What it is.")]
    binary: Annotated[
        bool, Meta(description="It says yes or no: its curve is one point, whatever the threshold.")
    ]
    curve: Annotated[tuple[Point, ...], Meta(description="By threshold.")]
    operating_point: Annotated[
        Point, Meta(description="At the site's warning probability, with intervals.")
    ]
    by_log: Annotated[dict[str, Point], Meta(description="The operating point of each judged log.")]
    by_zone: Annotated[dict[str, Point], Meta(description="The operating point of each zone.")]
    leads_s: Leads


class TradeOff(Part, frozen=True, kw_only=True):
    """A baseline over the values of its one parameter."""

    parameter: Annotated[str, Meta(description="What ``threshold`` of its points is.")]
    curve: tuple[Point, ...]


class LevelTable(Part, frozen=True, kw_only=True):
    """Alerts at a level or above, as the guard published them (with its delays and deadbands)."""

    total: Point
    zones: dict[str, Point]
    leads_s: Leads


class ReliabilityBin(Part, frozen=True, kw_only=True):
    """Answers of one tenth of the probabilities."""

    said: Annotated[float, Meta(description="Mean probability that was said.")]
    happened: Annotated[float, Meta(description="Share of the answers that came true.")]
    happened_interval: Interval
    count: Annotated[int, Meta(description="Answers.")]


class ReliabilityOf(Part, frozen=True, kw_only=True):
    """The guard's probability of contact within a horizon, against what happened."""

    horizon_s: Annotated[float, Meta(description="Time ahead that was asked about [s].")]
    answers: Annotated[
        int, Meta(description="Evaluations outside contact, of all zones, that could be judged.")
    ]
    calibration_error: Annotated[
        float | None,
        Meta(description="Mean |said - happened| over the bins, weighted by answers."),
    ]
    calibration_error_interval: Interval
    answers_told: Annotated[int, Meta(description="Answers with a probability of at least 0.02.")]
    calibration_error_told: Annotated[
        float | None,
        Meta(description="The error of these alone: most moments are far from any contact."),
    ]
    bins: tuple[ReliabilityBin, ...]


class ZoneLine(Part, frozen=True, kw_only=True):
    """What happened at one zone in one log."""

    contacts: Annotated[
        tuple[tuple[float, float | None], ...],
        Meta(description="Entry and leaving [s]; null: still in at the end."),
    ]
    inside_at_first_s: Annotated[
        float | None,
        Meta(
            description="How long the arm was inside from the first position on [s]; null: it was"
            " not. That is the first of the contacts, and counts as no crossing."
        ),
    ]
    alarms: Annotated[
        tuple[tuple[float, float | None, str], ...],
        Meta(
            description="Start and end [s] of each alarm of the guard at its operating point"
            " (null: still on at the end), and what it was: true, false or undecided."
        ),
    ]


class LogLine(Part, frozen=True, kw_only=True):
    """A log that was judged."""

    log: Annotated[str, Meta(description="Name of the log, without its folder.")]
    start_s: Annotated[float, Meta(description="Time of its first position [s].")]
    duration_s: Annotated[float, Meta(description="From the first position to the last [s].")]
    warnings: Annotated[tuple[str, ...], Meta(description="What was wrong with it.")]
    not_monitoring_s: Annotated[float, Meta(description="How long the guard did not monitor [s].")]
    not_monitoring: Annotated[
        tuple[tuple[float, float | None], ...],
        Meta(description="When: start and end [s]; null: to the end."),
    ]
    zones: dict[str, ZoneLine]


class PredictionError(Part, frozen=True, kw_only=True):
    """How far off one forecaster of the next displacement was, in shares of the range."""

    name: Annotated[str, Meta(description="For people.")]
    rms: Annotated[
        float,
        Meta(
            description="Of categories seen at least 5 times before; of all where there are none."
        ),
    ]
    rms_interval: Interval
    rms_all: Annotated[float, Meta(description="Of all primitives.")]
    answered: Annotated[float, Meta(description="Share of all primitives with a forecast.")]


class Report(Part, frozen=True, kw_only=True):
    """An evaluation of recorded work: how early, how often in vain, and how well foreseen."""

    schema: Annotated[str, Meta(description="Name and version of this form.")] = SCHEMA
    versions: Annotated[dict[str, str], Meta(description="Of what made it.")]
    name: Annotated[str, Meta(description="Of the sequence of logs.")]
    site: Annotated[str, Meta(description="Name of the site.")]
    machine: Annotated[str, Meta(description="Name of the machine.")]
    knowledge: Annotated[str, Meta(description="What was known of the operator, and when.")]
    zones: Annotated[tuple[str, ...], Meta(description="Zones that were judged.")]
    zones_left_out: Annotated[
        tuple[str, ...],
        Meta(description="Zones of objects that move: no log says where they truly were."),
    ]
    learned_from: Annotated[
        tuple[str, ...], Meta(description="Logs that only taught, with --frozen; not judged.")
    ]
    duration_s: Annotated[float, Meta(description="Of all judged logs [s].")]
    not_monitoring_s: Annotated[
        float, Meta(description="How much of it the guard did not monitor [s].")
    ]
    crossings: Annotated[
        int, Meta(description="Contacts in all judged logs, while the guard monitored.")
    ]
    warning_probability: Annotated[
        float, Meta(description="The site's: threshold of the operating points.")
    ]
    definitions: Annotated[dict[str, str], Meta(description="What each word means.")]
    forecasts: Annotated[dict[str, Forecast], Meta(description="The guard, then the baselines.")]
    trade_offs: Annotated[
        dict[str, TradeOff], Meta(description="Baselines over their one parameter.")
    ]
    published: Annotated[
        dict[str, LevelTable], Meta(description="The guard's own alerts, by level.")
    ]
    reliability: Annotated[
        tuple[ReliabilityOf, ...], Meta(description="Of the guard's probabilities, by horizon.")
    ]
    prediction: Annotated[
        dict[str, PredictionError], Meta(description="Forecasters of the next displacement.")
    ]
    prediction_details: Annotated[
        dict[str, Any], Meta(description="All that prediction.json holds.")
    ]
    logs: tuple[LogLine, ...]


def report_schema() -> dict[str, Any]:
    """JSON Schema 2020-12 of ``report.json``."""
    schema = msgspec.json.schema(Report)
    definitions = schema["$defs"]
    own = definitions.pop("Report")
    for part in (own, *definitions.values()):
        part["required"] = list(part["properties"])  # every field is always there
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:{SCHEMA.replace('.', ':')}",
        "title": "rampe-guard evaluation report",
        **own,
        "$defs": definitions,
    }


def report_bytes(report: Report) -> bytes:
    """The report as it stands in its file."""
    return msgspec.json.format(msgspec.json.encode(report), indent=1) + b"\n"
