"""What ``rampe-guard init`` measures from, and what it keeps of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from rampe_guard.core.identify import Measured
from rampe_guard.errors import LogError, SettingsError
from rampe_guard.programs.initing_plan import ActuatorPlan, Said
from rampe_guard.programs.initing_ros2 import speech
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.programs.measuring import Heard, heard_in_file, heard_in_json, reasons
from rampe_guard.programs.measuring_bag import heard_in_bag
from rampe_guard.programs.measuring_csv import heard_in_csv
from rampe_guard.programs.measuring_live import Listening, both_live, write_csv
from rampe_guard.programs.measuring_ros2 import Joints, heard_in_ros2
from rampe_guard.recording import is_mcap
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import ColumnMap

MEASURED = "measured.csv"
"""What was heard live, for `replay`."""
_TELL_S = 10.0
_USUAL_TIMEOUT_S, _LONGEST_TIMEOUT_S = 0.5, 2.0
_RARE = 0.999
_HOLE_S = 2.0
"""A longer silence is worth a word [s]."""


def heard_by(
    wishes: Wishes, joints: Sequence[str], console: Console, stop: StopFlag
) -> Heard | None:
    """What there is to measure from; None if nothing was named. ``joints`` are those of the URDF.

    ``wishes`` are settled: they have a format.

    Raises:
        LogError, SettingsError, ConnectionFailedError: it cannot be had.
    """
    if wishes.log is not None:
        return _of_file(wishes, joints, wishes.log)
    if not wishes.live:
        return None
    said, keys = _inputs(wishes)
    console.print(
        f"listening for {wishes.seconds:g} s on {said[0]} and {said[1]}:\n"
        "move each lever in turn, both ways, fully and gently, and let go each time"
    )
    told = [_TELL_S]

    def tell(passed_s: float, streams: list[Listening]) -> None:
        if passed_s >= told[0]:
            told[0] += _TELL_S
            counts = zip(streams, said, strict=True)
            text = ", ".join(f"{len(one.messages)} on {name}" for one, name in counts)
            console.print(f"  {passed_s:.0f} s: {text}")

    network = Network(wishes.connect, wishes.zenoh, wishes.plain_network)
    sticks, places = both_live(network, keys, wishes.seconds, stop, tell)
    where = ", ".join(network.endpoints) or network.config or "the local router"
    origin = f"{wishes.seconds:g} s at {where}"
    if wishes.format == "ros2":
        wanted = Joints(joints, wishes.joints)
        heard = heard_in_ros2(sticks.messages, places.messages, said, wanted, origin)
    else:
        heard = heard_in_json(sticks.messages, places.messages, said, origin)
    for name, one in (("joystick", sticks), ("actuators", places)):
        heard.refused.update({f"{name}: {word}": count for word, count in one.refused.items()})
    return heard


def _inputs(wishes: Wishes) -> tuple[tuple[str, str], tuple[str, str]]:
    """Both inputs as they were told, and their Zenoh keys."""
    if wishes.format == "ros2":
        spoken = speech(wishes)
        both = "joystick", "actuators"
        said, keys = ((way[both[0]], way[both[1]]) for way in (spoken.said, spoken.keys))
        return said, keys
    if wishes.joystick is None or wishes.actuators is None:
        raise SettingsError("to measure live, give --joystick KEY and --actuators KEY")
    keys = wishes.joystick, wishes.actuators
    return keys, keys


def _of_file(wishes: Wishes, joints: Sequence[str], path: str) -> Heard:
    if wishes.format == "ros2":
        wanted = Joints(joints, wishes.joints)
        return heard_in_bag(path, wishes.joystick, wishes.actuators, wanted)
    if is_mcap(path):
        return heard_in_file(path, wishes.joystick, wishes.actuators)
    return heard_in_csv(path, wishes.time, wishes.joystick, wishes.actuators)


def tell_heard(heard: Heard, measured: Sequence[Measured], console: Console) -> None:
    """What was heard, in a line.

    Raises:
        LogError: it is too short to measure anything.
    """
    traces = heard.traces
    console.print(
        f"{heard.origin}: {len(traces.lever_s)} levers with {traces.axes.shape[1]} axes,"
        f" {len(traces.time_s)} positions of {traces.position.shape[1]} actuators in"
        f" {heard.seconds:.0f} s{reasons(heard.refused)}",
        highlight=False,
    )
    together = traces.lever_s is traces.time_s
    parts = (("levers", traces.lever_s), ("positions", traces.time_s))
    for what, times in (("rows", traces.time_s),) if together else parts:
        steps = np.diff(np.sort(times))
        if steps.size and steps.max() > _HOLE_S:
            at_s = float(np.sort(times)[int(steps.argmax())] - times.min())
            text = f"note: no {what} for {steps.max():.0f} s, {at_s:.0f} s after the first"
            console.print(Text(text, "yellow"))
    if not measured:
        raise LogError(f"{heard.origin}: is too short; both inputs must be there for some seconds")


def kept_log(
    folder: Path, heard: Heard, plans: Sequence[ActuatorPlan], live: bool
) -> dict[str, Any] | None:
    """Columns for the site file's ``log``; what was heard live is written as a CSV log."""
    if heard.columns is not None:
        columns: dict[str, Any] = dict(heard.columns)
        columns["joystick"] = [heard.columns["joystick"][plan.axis.value] for plan in plans]
        return columns
    if not live:
        return None
    names = [plan.name for plan in plans]
    write_csv(folder / MEASURED, heard, names, [plan.axis.value for plan in plans])
    return {
        "time": ColumnMap("t"),
        "joystick": [ColumnMap(f"u_{name}") for name in names],
        "actuators": [ColumnMap(name) for name in names],
    }


def timeout_of(heard: Heard) -> Said | None:
    """A longer time-out of the inputs, if they come too rarely for the usual one."""
    gaps = [np.diff(np.sort(times)) for times in (heard.traces.lever_s, heard.traces.time_s)]
    rare_s = max(float(np.quantile(gap, _RARE)) for gap in gaps if gap.size)
    if 2.0 * rare_s <= _USUAL_TIMEOUT_S:
        return None
    value = min(_LONGEST_TIMEOUT_S, float(np.ceil(20.0 * rare_s) / 10.0))
    return Said(value, f"messages are up to {rare_s:.2f} s apart; silence is a fault", todo=True)
