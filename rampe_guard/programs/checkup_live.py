"""``rampe-guard check --live``: is what the site file names really there, sound and in time?"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

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


@dataclass(slots=True)
class Findings:
    """What was heard of a machine, in sentences.

    Attributes:
        deaf: an input that is needed is missing, or nothing of it can be used.
        wrong: what contradicts the site file: a guard would take it for what it is not.
        looks: what a guard can work with, and is mostly a mistake.
        notes: the rest.
    """

    deaf: bool = False
    wrong: list[str] = field(default_factory=list)
    looks: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def live_check(site: Site, limits: FloatArray, live: Live, console: Console) -> Findings:
    """Hear all inputs for a while, print what they are like, and return it.

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
    found = Findings()
    against_clocks(streams, site, found)
    against_motion(site, judge.traces(), found)
    words = "works" if guarded else "does not work"
    found.notes.append(f"a guard {words} on {site.keys.base} now")
    broken = [one for one in streams if one.problem is not None]
    red = [f"{one.name}: {one.problem}" for one in broken]
    if alive is False:
        red.append(f"nobody holds the token {site.keys.joystick_alive}: the joystick is dead")
    found.deaf = any(one.needed for one in broken) or alive is False
    _say(found, red, console)
    return found


def _say(found: Findings, red: Sequence[str], console: Console) -> None:
    for note in found.notes:
        console.print(Text(f"note: {note}", "yellow"))
    for look in found.looks:
        console.print(Text(f"look: {look}", "bold yellow"))
    for wrong in found.wrong:
        console.print(Text(f"wrong: {wrong}", "bold red"))
    for fault in red:
        console.print(Text(fault, "bold red"))


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
    return f"{size:.2g} s"


def against_clocks(streams: Sequence[Stream], site: Site, found: Findings) -> None:
    """What stamps say of the clocks of their senders.

    Where the one clock of all inputs starts is of no account to a guard, so all of them may be as
    far from this computer's as they like. It is looked at nevertheless: such stamps also come from
    a sender that replays, or keeps, what is long past.
    """
    fresh = _fresh(streams)
    for one in streams:
        if one.arrival_s.size and one.name not in fresh:
            found.notes.append(
                f"{one.name}: no stamps: the arrival counts, and delays are not seen"
            )
        ahead_s = fresh.get(one.name, 0.0)
        if abs(ahead_s) > _SKEW_S:
            side = "behind" if ahead_s > 0.0 else "ahead of"
            found.looks.append(
                f"{one.name}: its clock is {_span(ahead_s)} {side} this computer's; a guard goes"
                " by the stamps alone: is this what the machine does now?"
            )
    if "actuators" not in fresh:  # then a guard compares no stamps
        return
    for one in streams:
        if one.name not in fresh or one.name == "actuators":
            continue
        ahead_s = fresh["actuators"] - fresh[one.name]
        # of levers and positions, those that lag grow old; all else must not come early either
        most_s = site.guard.inputs.actuators_timeout_s if one.name == "joystick" else _SKEW_S
        apart = f"the clocks of {one.name} and actuators are {_span(ahead_s)} apart"
        if not -one.timeout_s <= ahead_s <= most_s:
            found.wrong.append(f"{apart}, which a guard does not accept: stamp both with one clock")
        elif abs(ahead_s) > _SKEW_S:
            found.looks.append(f"{apart}, or one takes so much longer: stamp both with one clock")
        else:
            ms = 1e3 * abs(ahead_s)
            found.notes.append(f"clocks of {one.name} and actuators: {ms:.1f} ms apart")


def against_motion(site: Site, traces: Traces, found: Findings) -> None:
    """What motion says against the site file."""
    measured = identify(traces)
    for actuator, seen in zip(site.guard.actuators, measured, strict=False):
        lever, top = seen.lever, seen.max_velocity
        if lever.axis is not None and lever.axis != actuator.axis:
            found.wrong.append(
                f"{actuator.name}: axis {lever.axis} moves it, and the site file says"
                f" {actuator.axis} ({lever.share:.0%} of the motion explained)"
            )
        elif lever.sign not in (0, actuator.sign):
            found.wrong.append(
                f"{actuator.name}: it moves against its lever ({lever.share:.0%} of the motion"
                f" explained): the site file's sign {actuator.sign} should be {lever.sign}"
            )
        elif lever.problem and seen.moved:
            found.notes.append(
                f"{actuator.name}: its lever is not compared with the site file: {lever.problem}"
            )
        if top is not None and top.value > _FAST * actuator.max_velocity:
            found.wrong.append(
                f"{actuator.name}: moves at {top.value:.3g} {actuator.unit}/s, and the site file's"
                f" max_velocity is {actuator.max_velocity:g}"
            )
    still = [a.name for a, m in zip(site.guard.actuators, measured, strict=False) if not m.moved]
    if not measured or still:
        names = ", ".join(still or site.actuator_names)
        found.notes.append(f"not moved meanwhile, so not compared with the site file: {names}")
