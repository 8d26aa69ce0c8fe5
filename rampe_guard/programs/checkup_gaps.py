"""What a guard of a site does not protect, and what is mostly a mistake: `check`'s sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from rampe_guard.assembly import Machine
from rampe_guard.core.scene import ActuatorLimit, Mesh
from rampe_guard.programs.checkup_reach import POSTURES, Reach


def gaps(machine: Machine) -> list[str]:
    """What is not protected, a sentence each."""
    return [*_arm(machine), *_zones(machine), *_site(machine)]


def suspects(machine: Machine, reach: Mapping[str, Reach]) -> list[str]:
    """What is legal and yet mostly a mistake: zones that alarm without end, or never."""
    return [*_always(reach), *_never(machine)]


def _arm(machine: Machine) -> Iterator[str]:
    for name, value in machine.arm.fixed_joints.items():
        yield f"joint {name!r} is driven by no actuator and held at {value:g}"
    yield from machine.sweeper.notes
    always = [f"{a} and {b}" for a, b in machine.sweeper.always_touching]
    if always:
        yield f"links that always touch are not swept: {', '.join(always)}"
    bare = _bare(machine)
    if bare:
        yield f"links without geometry are not swept: {', '.join(bare)}"
    endless = [
        actuator.name
        for actuator, ends in zip(machine.site.guard.actuators, machine.arm.limits, strict=True)
        if not np.isfinite(ends).all()
    ]
    if endless:
        yield f"no limits: {', '.join(endless)}; no position is refused as impossible"
    if not machine.site.self_collision.enabled:
        yield "the arm is not swept against itself (self_collision: {enabled: true})"


def _zones(machine: Machine) -> Iterator[str]:
    shaped = _shaped(machine)
    for zone in machine.site.scene.objects:
        if isinstance(zone, ActuatorLimit):
            continue
        ignored = sorted(set(zone.ignore_links) & shaped)
        if ignored and set(ignored) < shaped:
            yield f"zone {zone.name!r} does not guard against {', '.join(ignored)}"
        if isinstance(zone, Mesh) and zone.open:
            yield f"zone {zone.name!r} is a surface: what is wholly below it touches nothing"


def _never(machine: Machine) -> Iterator[str]:
    shaped = _shaped(machine)
    for zone in machine.site.scene.objects:
        if not isinstance(zone, ActuatorLimit) and shaped and shaped <= set(zone.ignore_links):
            yield f"zone {zone.name!r} ignores every link: it can never warn"


def _always(reach: Mapping[str, Reach]) -> Iterator[str]:
    for one in reach.values():
        if one.always:
            link = one.links.most_common(1)[0][0]
            yield (
                f"zone {one.name!r} is met in {one.inside} of {POSTURES} postures, mostly by"
                f" {link}: it will alarm nearly always; move it, or let {link} touch it"
                " (ignore_links)"
            )


def _site(machine: Machine) -> Iterator[str]:
    site = machine.site
    if site.keys.enabled is not None:
        held_s = site.guard.inputs.enabled_timeout_s
        yield (
            f"no alerts while {site.keys.enabled} says that the machine is switched off"
            f" (for {held_s:g} s after each such message)"
        )
    if site.guard.inputs.joystick_on_change:
        yield f"the joystick may be silent while {site.keys.joystick_alive} is there (on_change)"
    yield "a load, a hose or a tool that the URDF does not show is not swept"


def _shaped(machine: Machine) -> set[str]:
    return set(machine.arm.link_names) - set(_bare(machine))


def _bare(machine: Machine) -> list[str]:
    pairs = zip(machine.arm.link_names, machine.arm.meshes, strict=True)
    return [name for name, mesh in pairs if mesh is None]
