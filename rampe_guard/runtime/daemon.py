"""``rampe-guard run``: load, connect (for as long as it takes), work, end cleanly.

Before anything is guarded the canary is tried once, which also compiles or loads the kernels of
the sweep. A guard whose canary fails tells so for a while and ends with `UNTRUSTED`: a machine
that computes wrongly is not to be trusted again until its process has started anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from rampe_guard.assembly import Machine
from rampe_guard.collision.canary import Canary
from rampe_guard.errors import ConnectionFailedError, GeometryError
from rampe_guard.runtime.canary_watch import CanaryWatch
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.life import restarted_after
from rampe_guard.runtime.loading import load_telling
from rampe_guard.runtime.metrics_start import Show, served
from rampe_guard.runtime.minders import Minders
from rampe_guard.runtime.run_marker import RunMarker
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.scene_desk import Scenes
from rampe_guard.runtime.scene_kept import SceneKeeper
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.supervisor import UNTRUSTED
from rampe_guard.runtime.worker import Worker
from rampe_guard.runtime.zenoh_io import Bus, check_configuration
from rampe_guard.settings import MetricsSettings, Site, for_operator, load_site

if TYPE_CHECKING:
    from rampe_guard.runtime.ros2_publisher import RosVoice


def run(
    site_path: str,
    endpoints: Sequence[str],
    stop: StopFlag,
    operator: str | None = None,
    metrics: tuple[str, int] | None = None,
) -> int:
    """Guard a machine until told to stop.

    Args:
        site_path: the site file.
        endpoints: Zenoh endpoints instead of the site file's.
        stop: ends it.
        operator: who is at the levers, instead of whom the site file names.
        metrics: host and port to serve them on, instead of the site file's.

    Returns:
        The exit code: 0, or `UNTRUSTED` if the canary failed.

    Raises:
        SettingsError: the site file is wrong.
        GeometryError: its geometry cannot be used.
    """
    say, minders = Sayer("rampe_guard"), Minders()
    minders.waiting("loading")
    site = for_operator(connect_to(load_site(site_path), endpoints), operator)
    if site.ros2 is not None:
        from rampe_guard.ros2.cdr import store  # noqa: PLC0415 - others start without it

        store()  # before meshes are loaded: is the extra there?
    check_configuration(site.zenoh)  # before meshes are loaded, which takes a while
    where = MetricsSettings(*metrics) if metrics else site.metrics
    with served(where, say, again=restarted_after() is not None) as show:
        return _guard(site, stop, say, minders, show)


def _guard(site: Site, stop: StopFlag, say: Sayer, minders: Minders, show: Show | None) -> int:
    loaded = stop.unless_stopped(lambda: _load(site, say))
    if loaded is None:
        return 0
    machine, canary, scenes = loaded
    say.info(f"{site.machine} at {site.name}: {len(machine.sweeper.zones)} zones loaded")
    minders.waiting("waiting for a Zenoh router")
    bus = Bus.open_retrying(site.zenoh, stop, lambda text: say.warn("connect", text), stop.wait)
    if bus is None:
        return 0
    with bus:
        if bus.is_alive(f"{site.keys.base}/alive"):
            raise ConnectionFailedError(
                f"another guard already publishes under {site.keys.base}; stop it, or give this"
                " machine a base key of its own"
            )
        with (
            Keeper(site, machine.arm.limits, say) as keeper,
            RunMarker(site, say) as marker,
            _ros_voice(bus, machine, say) as voice,
        ):
            watch = CanaryWatch(canary)
            worker = Worker(
                machine, bus, say, keeper, watch, scenes, minders, marker, show=show, voice=voice
            )
            say.info(f"guarding on {site.keys.base}")
            untrusted = worker.run(stop, stop.wait)
            marker.clean = not untrusted
            minders.ending()
    say.info("ended: the canary failed" if untrusted else "stopped")
    return UNTRUSTED if untrusted else 0


def _ros_voice(bus: Bus, machine: Machine, say: Sayer) -> AbstractContextManager[RosVoice | None]:
    if machine.site.ros2 is None:
        return nullcontext()
    from rampe_guard.runtime.ros2_publisher import ros_voice  # noqa: PLC0415 - as above

    return ros_voice(bus, machine, say)


def _load(site: Site, say: Sayer) -> tuple[Machine, Canary, Scenes]:
    """Machine, canary, tried once (the worker tries it again before its first step), and scene."""
    keeper = SceneKeeper(site, say)
    source = keeper.recall()
    try:
        machine = load_telling(replace(site, scene=source.scene), say.info)
    except GeometryError as error:
        if source.put_by is None:
            raise
        source = keeper.give_up(source.put_by, error)
        machine = load_telling(replace(site, scene=source.scene), say.info)
    for note in machine.sweeper.notes:
        say.info(note)
    canary = Canary(machine.arm, site.sweep)
    canary.check()
    return machine, canary, Scenes(source, keeper)
