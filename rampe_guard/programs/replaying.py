"""``rampe-guard replay``: a recording or a CSV log through the guard, as fast as it goes."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

import numpy as np
from rich.console import Console, RenderableType
from rich.table import Table

from rampe_guard import wire
from rampe_guard.assembly import Machine
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent
from rampe_guard.core.guard import Guard
from rampe_guard.core.monitor import Status
from rampe_guard.errors import InterruptedReplayError, LogError, MessageError, ModelFileError
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.log_motion import motion_warnings
from rampe_guard.programs.scoring import closing_table
from rampe_guard.recording import Log, McapLog, McapReading, is_mcap, open_log
from rampe_guard.recording.bag import is_bag
from rampe_guard.recording.compare import ZoneComparison, changes, compare
from rampe_guard.recording.recorded_site import (
    learned_before,
    other_files,
    recorded_site,
    remembered_before,
)
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.messages import Scribe
from rampe_guard.runtime.replay import replay
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.store_format import header_of, situations_header
from rampe_guard.runtime.store_keeper import recall
from rampe_guard.runtime.store_situations import recall_situations
from rampe_guard.settings import Site, load_site

BOOT_ID = "replay"
"""Boot id of every offline replay: its output depends on nothing but site and log."""
_SHOWN = 5
"""So many differences are told one by one."""


def replay_offline(
    site_path: str | None,
    log_path: str,
    stop: StopFlag,
    *,
    repeats: bool,
    compare: bool = False,
    fresh: bool = False,
) -> Iterator[bytes]:
    """Alerts of a log as JSON lines (times are the log's); the score goes to stderr.

    Args:
        site_path: the site file; None for that in the recording.
        log_path: a recording, or a CSV file.
        stop: ends it.
        repeats: print repeats of alerts too.
        compare: hold the alerts against those that were given live, on stderr.
        fresh: begin without what had been learned before the recording.

    Raises:
        LogError: the log cannot be what the site file says.
        InterruptedReplayError: it was told to stop before the end.
    """
    with site_of(site_path, log_path) as site:
        machine = load_telling(site)
        log = open_log(site, log_path, machine.arm.limits)
        if compare and not isinstance(log, McapLog):
            raise LogError(f"{log_path}: a CSV log has no alerts to compare with")
        tell_warnings(site, log)
        if site_path is None and isinstance(log, McapLog) and isinstance(log.reading, McapReading):
            for what in other_files(log.reading):
                text = f"the recorded guard worked with another {what} than is attached"
                print(f"warning: {log_path}: {text}", file=sys.stderr)  # noqa: T201
        guard = machine.guard(log.first_s, BOOT_ID)
        if isinstance(log, McapLog) and not fresh:
            _recall(machine, log, guard)
        told: list[tuple[float, str | None, str]] = []
        yield from _lines(machine, log, guard, stop, told, repeats=repeats)
        if compare and isinstance(log, McapLog):
            Console(stderr=True).print(comparison(log, told))


@contextlib.contextmanager
def site_of(site_path: str | None, log_path: str) -> Iterator[Site]:
    """The site of a file, or else that of the recording itself.

    Raises:
        LogError: there is neither.
    """
    if site_path is not None:
        yield load_site(site_path)
        return
    if is_bag(log_path):
        raise LogError(f"{log_path}: a ROS bag has no site in it; give SITE before it")
    if not is_mcap(log_path):
        raise LogError(f"{log_path}: a CSV log has no site in it; give SITE before it")
    with recorded_site(McapReading(log_path)) as site:
        yield site


def tell_warnings(site: Site, log: Log) -> None:
    """What of a log is left out, missing or against the site file, on stderr."""
    for warning in (*log.warnings, *motion_warnings(site, log)):
        print(f"warning: {warning}", file=sys.stderr)  # noqa: T201
    for item in site.scene.moving:
        if item.name not in log.objects:
            print(  # noqa: T201
                f"warning: the log has no poses of {item.name} ({item.key}): it is unknown"
                " throughout, and taken as contact",
                file=sys.stderr,
            )


def _recall(machine: Machine, log: McapLog, guard: Guard) -> None:
    """Begin with what the recorded guard's memory held."""
    site, limits = machine.site, machine.arm.limits
    model, situations = learned_before(log.reading), remembered_before(log.reading)
    try:
        if model is not None:
            recall(model, header_of(site, limits), guard.rampe)
    except ModelFileError as error:
        _not_used(log, f"what was learned before the recording is not used: {error}")
    try:
        if situations is not None:
            recall_situations(situations, situations_header(site, limits), guard.situations)
    except ModelFileError as error:
        _not_used(log, f"what was remembered before the recording is not used: {error}")


def _not_used(log: McapLog, why: str) -> None:
    print(f"warning: {log.path}: {why}", file=sys.stderr)  # noqa: T201


def _moved(machine: Machine, log: Log, stop: StopFlag) -> Tally:
    """A tally that has seen where the arm truly was."""
    moving = {item.name for item in machine.site.scene.moving}
    still = tuple(zone for zone in machine.sweeper.zones if zone not in moving)
    tally, seen = Tally(machine.sweeper, still), False
    for t, q in log.positions():
        if stop():
            raise InterruptedReplayError("interrupted: no score")
        seen = True
        tally.position(t, q)
    if not seen:  # nothing is known of the arm, which is not the same as that it met nothing
        key = machine.site.keys.actuators
        raise LogError(f"nothing can be judged: there is no position of the arm, on {key}")
    return tally


def _lines(
    machine: Machine,
    log: Log,
    guard: Guard,
    stop: StopFlag,
    told: list[tuple[float, str | None, str]],
    *,
    repeats: bool,
) -> Iterator[bytes]:
    scribe = Scribe(machine.site, BOOT_ID, lambda now_s: log.epoch_s + now_s)
    tally = _moved(machine, log, stop)
    for now_s, events in replay(guard, log):
        if stop():
            raise InterruptedReplayError("interrupted: the alerts are not complete, no score")
        status = guard.snapshot(now_s).health.status
        tally.status(now_s, monitoring=status is not Status.NOT_MONITORING)
        for event in events:
            if not isinstance(event, AlertEvent):
                continue
            told.append((now_s, event.zone, event.level.word))
            if event.zone != SYSTEM_ZONE:
                tally.alert(now_s, event.zone, event.level)
            if repeats or event.kind == "transition":
                yield wire.encode(scribe.alert(event))
    console = Console(stderr=True)
    console.print(closing_table(tally))
    if moving := ", ".join(item.name for item in machine.site.scene.moving):
        console.print(f"Objects that move are not scored: {moving}.", highlight=False)


def comparison(log: McapLog, told: list[tuple[float, str | None, str]]) -> RenderableType:
    """Alerts that were given live beside those of the replay, as a table."""
    live = []
    for time_s, payload in log.published("alert"):
        with contextlib.suppress(MessageError):
            alert = wire.decode(payload, wire.Alert)
            live.append((time_s, alert.zone, alert.level))
    table = Table(box=None, padding=(0, 2, 0, 0), title_justify="left", title_style="bold")
    table.title = "changes of level, live and replayed"
    for name in ("zone", "same", "only live", "only replayed", "apart: median", "most"):
        table.add_column(name, justify="left" if name == "zone" else "right", header_style="dim")
    zones = compare(changes(live), changes(told))
    for zone in zones:
        apart_ms = np.abs(zone.apart_s) * 1e3
        times = [f"{f(apart_ms):.0f} ms" if zone.same else "—" for f in (np.median, np.max)]
        counts = (zone.same, len(zone.only_live), len(zone.only_replay))
        table.add_row(zone.zone, *map(str, counts), *times)
    table.caption = "\n".join(_differences(zones)) or None
    table.caption_justify = "left"
    return table


def _differences(zones: tuple[ZoneComparison, ...]) -> list[str]:
    """The first of those that only one side knows, in words."""
    found = [(t, f"{z.zone} {w} at {t:.2f} s: only live") for z in zones for t, w in z.only_live]
    found += [
        (t, f"{z.zone} {w} at {t:.2f} s: only replayed") for z in zones for t, w in z.only_replay
    ]
    lines = [text for _, text in sorted(found)]
    more = len(lines) - _SHOWN
    return [*lines[:_SHOWN], *([f"and {more} more"] if more > 0 else [])]
