"""The newest heartbeat, and the durations behind it, as metrics for Prometheus.

Nothing is measured here: what is scraped is what the heartbeat told, so the two cannot disagree.
A heartbeat that has grown old is told as `not_monitoring` with the reason ``no_heartbeat``,
whatever it said itself: the worker that made it may be stuck.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from rampe_guard import wire
from rampe_guard.errors import SettingsError
from rampe_guard.runtime.health import BUCKETS_MS, Durations, Pulse

try:
    from prometheus_client import CollectorRegistry, ProcessCollector
    from prometheus_client.core import (
        CounterMetricFamily,
        GaugeMetricFamily,
        HistogramMetricFamily,
        InfoMetricFamily,
        Metric,
    )
    from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
    from prometheus_client.registry import Collector
except ImportError as error:
    raise SettingsError(
        "--metrics and `metrics:` need prometheus-client: pip install 'rampe-guard[metrics]'"
    ) from error

CONTENT_TYPE: Final = CONTENT_TYPE_LATEST
OLD_S: Final = 1.0
"""Age of a heartbeat from which on it is no news [s]: five of them are missing."""
STATUSES: Final = ("ok", "degraded", "not_monitoring")
LEVELS: Final = ("caution", "warning", "imminent")
NO_HEARTBEAT: Final = "no_heartbeat"
_PREFIX: Final = "rampe_guard"


@dataclass(frozen=True, slots=True)
class Timed:
    """Durations counted up to some moment: by bucket, and their sum [ms]."""

    counts: tuple[int, ...]
    total_ms: float

    @classmethod
    def of(cls, spent: Durations) -> Timed:
        """As they are now."""
        return cls(tuple(spent.counts), spent.total_ms)


@dataclass(frozen=True, slots=True)
class Shown:
    """One heartbeat with its durations, made by the worker, read by scrapes; never changed."""

    beat: wire.Heartbeat
    at_s: float
    loop: Timed
    sweep: Timed


class Metrics(Collector):
    """Collects from the heartbeat that it was shown last.

    Args:
        clock: monotonic time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._shown: Shown | None = None
        self._registry = CollectorRegistry(auto_describe=False)
        self._registry.register(self)
        ProcessCollector(registry=self._registry)

    def show(self, beat: wire.Heartbeat, pulse: Pulse, at_s: float) -> None:
        """Take a heartbeat; called by the worker, costs it some microseconds and never waits."""
        self._shown = Shown(beat, at_s, Timed.of(pulse.loop_ms), Timed.of(pulse.sweep_ms))

    def text(self) -> bytes:
        """All metrics in the text format of Prometheus."""
        return generate_latest(self._registry)

    def describe(self) -> list[Metric]:
        """Nothing: names depend on no state that could clash."""
        return []

    def collect(self) -> Iterator[Metric]:
        """The metrics of the newest heartbeat."""
        shown = self._shown  # one look: the worker may show another one meanwhile
        if shown is None:
            return
        beat, age_s = shown.beat, self._clock() - shown.at_s
        yield from _status(beat, age_s)
        yield from _inputs(beat, age_s)
        yield from _objects(beat, age_s)
        yield _histogram("loop_seconds", "Steps: from an input to its alerts.", shown.loop)
        yield _histogram("sweep_seconds", "Sweeps of one forecast.", shown.sweep)
        yield from _memory(beat)
        yield from _canary(beat, age_s)
        yield from _commands(beat)


def _status(beat: wire.Heartbeat, age_s: float) -> Iterator[Metric]:
    old = age_s > OLD_S
    status = "not_monitoring" if old else beat.status
    codes = {reason.code for reason in beat.reasons} | ({NO_HEARTBEAT} if old else set())
    info = InfoMetricFamily(_PREFIX, "Whose guard this is, and what it works with.")
    words = ("site", "machine", "version", "boot_id", "scene_hash", "config_hash")
    info.add_metric([], {word: str(getattr(beat, word)) for word in words})
    yield info
    yield _gauges(
        "status", "1 for the status in force.", "status", {s: float(s == status) for s in STATUSES}
    )
    yield _gauges(
        "reason", "1 for each reason why the status is not ok.", "code", dict.fromkeys(codes, 1.0)
    )
    yield _gauge("heartbeat_age_seconds", "Age of the newest heartbeat of the worker.", age_s)
    yield _counter("heartbeats", "Heartbeats since the boot.", beat.seq)
    yield _gauge("uptime_seconds", "Time since the boot.", beat.uptime_s)
    yield _counter("turns", "Turns of the worker loop since the boot.", beat.tick)
    yield _counter("overruns", "How often a queue of inputs was found full.", beat.drops)
    yield _gauge("router_connected", "1 if a Zenoh router is there.", _flag(beat.router))
    if beat.alerts is not None:
        levels = {level: float(beat.alerts.get(level, 0)) for level in ("clear", *LEVELS)}
        text = "Alerts by level; clear ones wait for an acknowledgement."
        yield _gauges("alerts", text, "level", levels)


def _inputs(beat: wire.Heartbeat, age_s: float) -> Iterator[Metric]:
    ages = {"joystick": beat.input_age_s.joystick_s, "actuators": beat.input_age_s.actuators_s}
    rates = {"joystick": beat.rates_hz.joystick, "actuators": beat.rates_hz.actuators}
    old = {name: None if age is None else age + age_s for name, age in ages.items()}
    yield _gauges("input_age_seconds", "Age of the newest accepted message.", "input", old)
    yield _gauges("input_rate_hertz", "Accepted messages per second.", "input", rates)
    accepted = CounterMetricFamily(
        _name("input_accepted"), "Messages accepted since the boot.", labels=["input"]
    )
    for name in sorted({*ages, *beat.accepted}):
        accepted.add_metric([name], beat.accepted.get(name, 0))
    yield accepted
    rejected = CounterMetricFamily(
        _name("input_rejected"), "Messages refused since the boot.", labels=["input", "reason"]
    )
    for name, reasons in sorted(beat.rejected.items()):
        for reason, count in sorted(reasons.items()):
            rejected.add_metric([name, reason], count)
    yield rejected


def _objects(beat: wire.Heartbeat, age_s: float) -> Iterator[Metric]:
    if not beat.objects:
        return
    ages = {o.name: None if o.age_s is None else o.age_s + age_s for o in beat.objects}
    placed = {o.name: float(o.placed) for o in beat.objects}
    yield _gauges("object_age_seconds", "Age of the newest accepted pose.", "object", ages)
    yield _gauges("object_placed", "1 if it is known where it is.", "object", placed)
    accepted = CounterMetricFamily(
        _name("object_accepted"), "Poses accepted since the boot.", labels=["object"]
    )
    rejected = CounterMetricFamily(
        _name("object_rejected"), "Poses refused since the boot.", labels=["object", "reason"]
    )
    for item in beat.objects:
        accepted.add_metric([item.name], item.accepted)
        for reason, count in sorted(item.rejected.items()):
            rejected.add_metric([item.name, reason], count)
    yield accepted
    yield rejected


def _memory(beat: wire.Heartbeat) -> Iterator[Metric]:
    if beat.learned is not None:
        yield _gauge("categories", "Categories of primitives met.", beat.learned.categories)
        yield _gauge("occurrences", "Primitives learned.", beat.learned.occurrences)
    if beat.memory is not None:
        yield _gauge("situations", "Situations remembered.", beat.memory.situations)
        yield _gauge("situations_work_seconds", "Work that they span.", beat.memory.work_s)
    primitives = CounterMetricFamily(
        _name("primitives"), "Finished primitives since the boot.", labels=["outcome"]
    )
    for outcome, count in sorted(beat.primitives.items()):
        primitives.add_metric([outcome], count)
    yield primitives
    yield _counter("save_failures", "Saves of what is learned that failed.", beat.save_failures)


def _canary(beat: wire.Heartbeat, age_s: float) -> Iterator[Metric]:
    if beat.canary is not None:
        good = float(beat.canary.result == "ok")
        yield _gauge("canary_ok", "1 if this machine computes what is so.", good)
        yield _gauge("canary_age_seconds", "Age of the newest trial.", beat.canary.age_s + age_s)


def _commands(beat: wire.Heartbeat) -> Iterator[Metric]:
    if beat.commands is None:
        return
    family = CounterMetricFamily(
        _name("commands"), "What people wanted since the boot.", labels=["command", "outcome"]
    )
    told = {"granted": beat.commands.granted, "refused": beat.commands.refused}
    for outcome, counts in told.items():
        for command, count in sorted(counts.items()):
            family.add_metric([command, outcome], count)
    yield family


def _name(name: str) -> str:
    return f"{_PREFIX}_{name}"


def _flag(value: bool | None) -> float | None:
    return None if value is None else float(value)


def _gauge(name: str, text: str, value: float | None) -> Metric:
    family = GaugeMetricFamily(_name(name), text)
    if value is not None:  # unknown is missing, never 0
        family.add_metric([], value)
    return family


def _counter(name: str, text: str, value: float | None) -> Metric:
    family = CounterMetricFamily(_name(name), text)
    if value is not None:
        family.add_metric([], value)
    return family


def _gauges(name: str, text: str, label: str, values: Mapping[str, float | None]) -> Metric:
    family = GaugeMetricFamily(_name(name), text, labels=[label])
    for word, value in sorted(values.items()):
        if value is not None:
            family.add_metric([word], value)
    return family


def _histogram(name: str, text: str, timed: Timed) -> Metric:
    buckets, below = [], 0
    for end_ms, count in zip((*BUCKETS_MS, None), timed.counts, strict=True):
        below += count
        buckets.append(("+Inf" if end_ms is None else repr(end_ms / 1e3), float(below)))
    family = HistogramMetricFamily(_name(name), text)
    family.add_metric([], buckets, timed.total_ms / 1e3)
    return family
