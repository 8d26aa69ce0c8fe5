"""``rampe-guard replay``: a CSV log through the guard, offline, or live onto Zenoh."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from rich.console import Console

from rampe_guard import wire
from rampe_guard.collision import load_arm
from rampe_guard.core.events import SYSTEM_ZONE, AlertEvent
from rampe_guard.errors import ConnectionFailedError, InterruptedReplayError
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.scoring import closing_table
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.csv_log import CsvLog, read_csv_log
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.messages import Scribe
from rampe_guard.runtime.player import Frame, Player
from rampe_guard.runtime.replay import replay
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site

BOOT_ID = "replay"
"""Boot id of every offline replay: its output depends on nothing but site and log."""


def replay_offline(
    site_path: str, log_path: str, stop: StopFlag, *, repeats: bool
) -> Iterator[bytes]:
    """Alerts of a log as JSON lines (times are the log's); the score goes to stderr.

    Raises:
        LogError: the log cannot be what the site file says.
        InterruptedReplayError: it was told to stop before the end.
    """
    site = load_site(site_path)
    machine = load_telling(site)
    log = _read(read_csv_log(site, log_path, machine.arm.limits))
    for item in site.scene.moving:
        print(  # noqa: T201
            f"warning: the log has no poses of {item.name} ({item.key}): it is unknown"
            " throughout, and taken as contact",
            file=sys.stderr,
        )
    guard = machine.guard(float(log.time_s[0]), BOOT_ID)
    scribe = Scribe(site, BOOT_ID, lambda now_s: now_s)
    tally = Tally(machine.sweeper, machine.sweeper.zones)
    for t, q in zip(log.time_s.tolist(), log.position, strict=True):
        if stop():
            raise InterruptedReplayError("interrupted: no score")
        tally.position(t, q)
    for now_s, events in replay(guard, log):
        if stop():
            raise InterruptedReplayError("interrupted: the alerts are not complete, no score")
        for event in events:
            if not isinstance(event, AlertEvent):
                continue
            if event.zone != SYSTEM_ZONE:
                tally.alert(now_s, event.zone, event.level)
            if repeats or event.kind == "transition":
                yield wire.encode(scribe.alert(event))
    Console(stderr=True).print(closing_table(tally))


def replay_live(
    site_path: str, log_path: str, endpoints: Sequence[str], speed: float, stop: StopFlag
) -> int:
    """Publish a log on the site's keys, ``speed`` times as fast as it was recorded.

    Raises:
        LogError: the log cannot be what the site file says.
        ConnectionFailedError: no router, or nobody listens.
    """
    site = connect_to(load_site(site_path), endpoints)
    log = _read(read_csv_log(site, log_path, load_arm(site.arm).limits))
    with Bus.open(site.zenoh) as bus:
        player = Player(bus, site)
        if not player.wait_for_listener(stop):
            raise ConnectionFailedError(f"nobody listens on {site.keys.actuators}; start the guard")
        sent = player.play(_frames(log), stop, speed)
    print(f"{sent} of {len(log.time_s)} rows sent", file=sys.stderr)  # noqa: T201
    return 0


def _frames(log: CsvLog) -> Iterator[Frame]:
    first_s = float(log.time_s[0])
    for t, axes, q in zip(log.time_s.tolist(), log.axes, log.position, strict=True):
        yield Frame(t - first_s, t, axes, q, None)


def _read(log: CsvLog) -> CsvLog:
    for warning in log.warnings:
        print(f"warning: {warning}", file=sys.stderr)  # noqa: T201
    return log
