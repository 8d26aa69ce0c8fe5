"""Questions of ``rampe-guard init`` to who sits at the terminal, each with its default."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from rampe_guard.errors import SettingsError
from rampe_guard.programs.initing_ros2 import ACTUATORS_TOPIC, JOYSTICK_TOPIC
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.settings.ros2_keys import MOST_DOMAIN, Transport

A = TypeVar("A", bound=str)
Ask = Callable[[str], str]
"""Shows a prompt; returns the line that was typed, empty for the default."""

CYLINDER = ("base_m", "rod_m", "length_at_zero_m", "angle_offset_rad", "direction")
_LEAST = 3
"""So many of them must be given."""
_ASKED = (
    ("base_m", "distance from the pivot to the barrel pin [m]"),
    ("rod_m", "distance from the pivot to the rod pin [m]"),
    ("length_at_zero_m", "length between the pins when the actuator reads 0 [m]"),
    ("angle_offset_rad", "joint value where the angle at the pivot would be 0 [rad]"),
    ("direction", "1 if the joint value grows as the cylinder lengthens, else -1"),
)


def source_asked(wishes: Wishes, ask: Ask) -> Wishes:
    """Names, and what is measured from, where flags do not say."""
    wishes = replace(wishes, site=_text(ask, "Name of the site", wishes.site))
    wishes = replace(wishes, machine=_text(ask, "Name of the machine", wishes.machine))
    if wishes.log or wishes.connect or wishes.zenoh:
        return wishes
    log = _text(ask, "Recording to measure from (MCAP; empty: listen live, or nothing)", "")
    if log:
        return replace(wishes, log=log)
    end = _text(ask, "Zenoh endpoint to listen on, such as tcp/127.0.0.1:7447 (empty: none)", "")
    if not end:
        return wishes
    wishes = replace(_format_asked(wishes, ask), connect=(end,))
    keys, what = (f"{wishes.base}/joystick", f"{wishes.base}/actuators"), "Key"
    if wishes.format == "ros2":
        keys, what = (JOYSTICK_TOPIC, ACTUATORS_TOPIC), "Topic"
    return replace(
        wishes,
        joystick=_text(ask, f"{what} of the joystick", wishes.joystick or keys[0]),
        actuators=_text(ask, f"{what} of the actuators", wishes.actuators or keys[1]),
        seconds=_number(
            ask, "Move each lever, gently and fully, both ways. Seconds", wishes.seconds
        ),
    )


def _format_asked(wishes: Wishes, ask: Ask) -> Wishes:
    """What the messages are, and how those of ROS 2 travel."""
    said = wishes.format or _choice(ask, "Messages are json or ros2", ("json", "ros2"))
    if said != "ros2":
        return replace(wishes, format=said)
    ways: tuple[Transport, ...] = ("rmw_zenoh", "ros2dds")
    way = wishes.transport or _choice(ask, "They travel by rmw_zenoh or ros2dds", ways)
    domain = wishes.domain
    if way == "rmw_zenoh" and domain is None:
        domain = int(_choice(ask, "ROS_DOMAIN_ID", tuple(map(str, range(MOST_DOMAIN + 1)))))
    return replace(wishes, format=said, transport=way, domain=domain)


def names_asked(names: Sequence[str], joints: Sequence[str], ask: Ask) -> list[str]:
    """A name for each actuator."""
    pairs = zip(names, joints, strict=True)
    return [
        _text(ask, f"Actuator {i} (joint {joint}) is called", name)
        for i, (name, joint) in enumerate(pairs)
    ]


def drives_asked(
    names: Sequence[str], known: dict[str, dict[str, Any]], ask: Ask
) -> dict[str, dict[str, Any]]:
    """Cylinders, for those that have one."""
    found = dict(known)
    for name in names:
        if name in found:
            continue
        answer = _text(
            ask, f"Is {name} moved by a hydraulic cylinder whose stroke is measured? y/n", "n"
        )
        if answer.lower().startswith("y"):
            usual = {"angle_offset_rad": 0.0, "direction": 1.0}
            found[name] = cylinder(
                ",".join(f"{_number(ask, f'  {text}', usual.get(key)):g}" for key, text in _ASKED),
                f"cylinder of {name}",
            )
    return found


def cylinders(given: Sequence[str]) -> dict[str, dict[str, Any]]:
    """``NAME=BASE,ROD,LENGTH[,ANGLE[,DIRECTION]]`` of the command line.

    Raises:
        SettingsError: it is not written so.
    """
    found = {}
    for text in given:
        name, _, numbers = text.partition("=")
        found[name.strip()] = cylinder(numbers, f"--cylinder {text!r}")
    return found


def cylinder(text: str, where: str) -> dict[str, Any]:
    """Numbers in the order of `CYLINDER`; the last two may be left out.

    Raises:
        SettingsError: they are none, or too few.
    """
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    good = _LEAST <= len(values) <= len(CYLINDER) and all(map(math.isfinite, values))
    drive: dict[str, Any] = dict(zip(CYLINDER, values, strict=False))
    if not good or drive.get("direction", 1.0) not in (-1.0, 1.0) or min(values[:_LEAST]) <= 0.0:
        raise SettingsError(
            f"{where}: give base_m,rod_m,length_at_zero_m[,angle_offset_rad[,direction]], the"
            " lengths above 0, direction 1 or -1"
        )
    if "direction" in drive:
        drive["direction"] = int(drive["direction"])
    return drive


def _text(ask: Ask, question: str, default: str) -> str:
    return ask(f"{question} [{default}]: ").strip() or default


def _choice(ask: Ask, question: str, answers: Sequence[A]) -> A:
    """One of them; the first is the default."""
    while (answer := _text(ask, question, answers[0])) not in answers:
        pass
    return next(one for one in answers if one == answer)


def _number(ask: Ask, question: str, default: float | None) -> float:
    shown = "" if default is None else f" [{default:g}]"
    while True:
        answer = ask(f"{question}{shown}: ").strip()
        if not answer and default is not None:
            return default
        try:
            value = float(answer)
        except ValueError:
            continue
        if math.isfinite(value):
            return value
