"""``rampe-guard check --live``: is what the site file names really there, sound and in time?"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from rampe_guard.core.identify import Traces, identify
from rampe_guard.core.types import FloatArray
from rampe_guard.programs.checkup_streams import OBJECT, Judge, Stream
from rampe_guard.programs.measuring_live import listen
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site

_SKEW_S = 0.3
"""Clocks that look further apart than this are two clocks."""
_FAST = 1.2
"""Share of the top speed that a measured one may reach."""


@dataclass(frozen=True, slots=True)
class Live:
    """What was asked for: endpoints instead of the site's, for how long [s], what ends it."""

    connect: tuple[str, ...]
    seconds: float
    stop: StopFlag


def live_check(site: Site, limits: FloatArray, live: Live, console: Console) -> bool:
    """Hear all inputs for a while and print what they are like; whether a guard could work.

    Args:
        site: as it is loaded.
        limits: of its actuators (n, 2) [unit].
        live: what was asked for.
        console: for people.

    Raises:
        ConnectionFailedError: no router answers.
    """
    site = connect_to(site, live.connect)
    wanted = _wanted(site)
    console.print(f"\nlistening for {live.seconds:g} s", highlight=False)
    with Bus.open(site.zenoh) as bus:
        alive = None if site.keys.joystick_alive is None else bus.is_alive(site.keys.joystick_alive)
        heard = listen(bus, tuple(key for _, key, _ in wanted), live.seconds, live.stop)
        end_s = time.time()
        guarded = bus.is_alive(f"{site.keys.base}/alive")
    judge = Judge(site, limits)
    streams = [
        judge.stream(name, timeout_s, one, end_s)
        for (name, _, timeout_s), one in zip(wanted, heard, strict=True)
    ]
    console.print()
    console.print(_table(streams))
    console.print()
    notes = [*_clocks(streams), *_motion(site, judge.traces())]
    if alive is False:
        notes.append(f"nobody holds the token {site.keys.joystick_alive}: the joystick is dead")
    words = "works" if guarded else "does not work"
    notes.append(f"a guard {words} on {site.keys.base} now")
    for note in notes:
        console.print(Text(f"note: {note}", "yellow"))
    broken = [one for one in streams if one.problem is not None]
    for one in broken:
        console.print(Text(f"{one.name}: {one.problem}", "bold red"))
    skew_s, inputs = _skew_s(_fresh(streams)), site.guard.inputs
    if abs(skew_s) > min(inputs.joystick_timeout_s, inputs.actuators_timeout_s):
        console.print(Text("a guard does not accept clocks so far apart", "bold red"))
        return False
    return not any(one.needed for one in broken) and alive is not False


def _wanted(site: Site) -> list[tuple[str, str, float]]:
    """Name, key and time-out of every input."""
    inputs = site.guard.inputs
    wanted = [
        ("joystick", site.keys.joystick, inputs.joystick_timeout_s),
        ("actuators", site.keys.actuators, inputs.actuators_timeout_s),
    ]
    if site.keys.enabled is not None:
        wanted.append(("enabled", site.keys.enabled, inputs.enabled_timeout_s or 0.0))
    return wanted + [
        (OBJECT + i.name, i.key, i.timeout_s) for i in site.scene.moving if i.key is not None
    ]


def _table(streams: Sequence[Stream]) -> Table:
    table = Table(title="inputs, live", title_justify="left", title_style="bold", box=None)
    table.pad_edge = False
    for column in ("what", "used", "rate", "longest gap", "stamp to arrival: p50, p99", "refused"):
        table.add_column(column, header_style="dim", overflow="fold")
    for one in streams:
        gaps = np.diff(one.arrival_s)
        span_s = float(one.arrival_s[-1] - one.arrival_s[0]) if len(gaps) else 0.0
        way = one.latency_s
        table.add_row(
            one.name,
            str(len(one.arrival_s)),
            f"{len(gaps) / span_s:.1f}/s" if span_s > 0.0 else "-",
            f"{gaps.max():.3f} s" if len(gaps) else "-",
            f"{_ms(way, 50)}, {_ms(way, 99)}" if len(way) else "no stamps",
            ", ".join(f"{n} {reason}" for reason, n in one.refused.most_common()) or "none",
        )
    return table


def _ms(seconds: FloatArray, percent: int) -> str:
    return f"{1e3 * float(np.percentile(seconds, percent)):.1f} ms"


def _fresh(streams: Sequence[Stream]) -> dict[str, float]:
    """How old the freshest message of each input looked at its arrival [s]."""
    return {one.name: float(one.latency_s.min()) for one in streams if len(one.latency_s)}


def _span(seconds: float) -> str:
    """A time that people can read."""
    size = abs(seconds)
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if size >= 2.0 * length or size == length:
            return f"{size / length:.1f} {unit}"
    return f"{size:.3g} s"


def _skew_s(fresh: dict[str, float]) -> float:
    """How far the clock of the joystick is ahead of that of the actuators [s]; 0 if unknown."""
    if "joystick" in fresh and "actuators" in fresh:
        return fresh["actuators"] - fresh["joystick"]
    return 0.0


def _clocks(streams: Sequence[Stream]) -> Iterator[str]:
    """What stamps say of the clocks of their senders."""
    fresh = _fresh(streams)
    for one in streams:
        if one.arrival_s.size and one.name not in fresh:
            yield f"{one.name}: no stamps: the arrival counts, and delays are not seen"
        ahead_s = fresh.get(one.name, 0.0)
        if abs(ahead_s) > _SKEW_S:
            side = "behind" if ahead_s > 0.0 else "ahead of"
            yield f"{one.name}: its clock is {_span(ahead_s)} {side} this computer's"
    if "joystick" in fresh and "actuators" in fresh:
        skew_s = _skew_s(fresh)
        if abs(skew_s) > _SKEW_S:
            yield (
                f"the clocks of joystick and actuators are {_span(skew_s)} apart: stamp both"
                " with one clock"
            )
        else:
            yield f"clocks of joystick and actuators: {1e3 * abs(skew_s):.1f} ms apart"


def _motion(site: Site, traces: Traces) -> Iterator[str]:
    """What motion says against the site file."""
    measured = identify(traces)
    for actuator, seen in zip(site.guard.actuators, measured, strict=False):
        lever, top = seen.lever, seen.max_velocity
        if lever.axis is not None and lever.axis != actuator.axis:
            yield (
                f"{actuator.name}: axis {lever.axis} moves it, and the site file says"
                f" {actuator.axis} ({lever.share:.0%} of the motion explained)"
            )
        elif lever.sign not in (0, actuator.sign):
            yield (
                f"{actuator.name}: it moves against its lever ({lever.share:.0%} of the motion"
                f" explained): the site file's sign {actuator.sign} should be {lever.sign}"
            )
        if top is not None and top.value > _FAST * actuator.max_velocity:
            yield (
                f"{actuator.name}: moves at {top.value:.3g} {actuator.unit}/s, and max_velocity is"
                f" {actuator.max_velocity:g}"
            )
    still = [a.name for a, m in zip(site.guard.actuators, measured, strict=False) if not m.moved]
    if not measured or still:
        names = ", ".join(still or site.actuator_names)
        yield f"not moved meanwhile, so not compared with the site file: {names}"
