"""``rampe-guard replay --live``: a log onto Zenoh, as if the machine were working now."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from rampe_guard.collision import load_arm
from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.programs.replaying import site_of, tell_warnings
from rampe_guard.recording import Log, McapLog, open_log
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.player import Frame, Player
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus


def replay_live(
    site_path: str | None, log_path: str, endpoints: Sequence[str], speed: float, stop: StopFlag
) -> int:
    """Publish a log on the site's keys, ``speed`` times as fast as it was recorded.

    Raises:
        LogError: the log cannot be what the site file says.
        SettingsError: nobody said onto which network.
        ConnectionFailedError: no router, or nobody listens.
    """
    if site_path is None and not endpoints:
        raise SettingsError(
            f"onto which network shall {log_path} be played? Give --connect: the recorded one may"
            " be that of a machine at work"
        )
    with site_of(site_path, log_path) as recorded:
        site = connect_to(recorded, endpoints)
        log = open_log(site, log_path, load_arm(site.arm).limits)
        tell_warnings(site, log)
        with Bus.open(site.zenoh) as bus:
            player = Player(bus, site)
            if not player.wait_for_listener(stop):
                raise ConnectionFailedError(
                    f"nobody listens on {site.keys.actuators}; start the guard"
                )
            if isinstance(log, McapLog):
                said = f"{player.post(log.posts(), stop, speed)} messages sent"
            else:
                said = f"{player.play(_frames(log), stop, speed)} of {len(log.time_s)} rows sent"
    print(said, file=sys.stderr)  # noqa: T201
    return 0


def _frames(log: Log) -> Iterator[Frame]:
    for t, axes, q in zip(log.time_s.tolist(), log.axes, log.position, strict=True):
        yield Frame(t - log.first_s, t, axes, q, None)
