"""A new site file and scene file as text, every value with where it came from behind it."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from rampe_guard.programs.initing_plan import ActuatorPlan, Said
from rampe_guard.settings import ColumnMap

_WIDTH = 4096
"""Nothing is folded: a comment stays behind its value."""
_UNITS = {"max_velocity": "/s", "max_deceleration": "/s²"}


@dataclass(frozen=True, slots=True)
class SiteText:
    """All that a new site file says.

    Attributes:
        site, machine: names.
        joystick, actuators: keys.
        base: what the keys of the machine begin with.
        origin: what it was made from, in words.
        urdf: path, relative to the site file.
        package_dirs, allow: folders, relative to the site file.
        plans: of the actuators.
        order_sure: whether it is certain which joint each actuator is.
        connect: Zenoh endpoints; empty for the usual one.
        plain: messages without certificates may leave the machine.
        timeout_s: of both inputs, where they come rarely.
        log: columns of a CSV log, if it came from one.
        ros2: how ROS 2 is spoken, where it is; then keys are topics.
    """

    site: str
    machine: str
    joystick: str
    actuators: str
    base: str
    origin: str
    urdf: str
    package_dirs: tuple[str, ...]
    allow: tuple[str, ...]
    plans: Sequence[ActuatorPlan]
    order_sure: bool
    connect: tuple[str, ...] = ()
    plain: bool = False
    timeout_s: Said | None = None
    log: Mapping[str, Any] | None = None
    ros2: Mapping[str, Said] | None = None


def site_text(said: SiteText) -> str:
    """The site file."""
    root = CommentedMap()
    root["site"], root["machine"] = said.site, said.machine
    root.yaml_set_start_comment(
        f"Site file made by `rampe-guard init` from {said.origin}.\n"
        "Paths are relative to this file. Look at every TODO, then: rampe-guard check FILE"
    )
    zenoh = CommentedMap()
    if said.connect:
        zenoh["connect"] = _flow(said.connect)
    if said.plain:
        zenoh["plain_network"] = "i accept that anyone on this network can read and forge messages"
    if zenoh:
        root["zenoh"] = zenoh
    root["keys"] = CommentedMap(
        joystick=said.joystick, actuators=said.actuators, base=f"{said.base}/guard"
    )
    root["keys"].yaml_add_eol_comment("all that the guard publishes lies below", key="base")
    if said.ros2 is not None:
        root["format"] = "ros2"
        root.yaml_add_eol_comment("sensor_msgs/Joy and JointState; keys are topics", key="format")
        root["ros2"] = _ros2(said.ros2)
    root["arm"] = _arm(said)
    root["scene"] = "scene.yaml"
    if said.allow:
        root["files"] = CommentedMap(allow=_flow(said.allow))
        root["files"].yaml_add_eol_comment("folders of the URDF and its meshes", key="allow")
    if said.timeout_s is not None:
        one = CommentedMap(timeout_s=said.timeout_s.value)
        one.yaml_add_eol_comment(said.timeout_s.comment, key="timeout_s")
        root["inputs"] = CommentedMap(
            joystick=one, actuators=CommentedMap(timeout_s=said.timeout_s.value)
        )
    if said.log is not None:
        root["log"] = _log(said.log, [one.name for one in said.plans])
    for key in ("zenoh", "keys", "arm", "scene", "inputs", "log"):
        if key in root:
            root.yaml_set_comment_before_after_key(key, before="\n" + _BEFORE.get(key, ""))
    return _dumped(root)


_BEFORE = {
    "keys": "Exact Zenoh keys; the machine publishes the first two.",
    "arm": "Actuators in the order of the position array on the wire; axis is the place of the\n"
    "lever in the joystick message. Values err towards an earlier warning.",
    "log": "Columns of CSV logs for `rampe-guard replay`: value = raw x scale + offset.",
}


def scene_text(site: str, ground_m: float, standing: Sequence[str]) -> str:
    """A scene with nothing but the ground, and examples to fill it.

    Args:
        site: its name.
        ground_m: height of the ground in the world [m].
        standing: links that stand on it.
    """
    links = io.StringIO()
    YAML().dump(_flow(standing), links)
    ignored = links.getvalue().strip() or "[]"
    return _SCENE.format(site=" ".join(site.split()), ground=ground_m, links=ignored)


_SCENE = """\
# What the machine at {site} must not touch. Metres and radians; the world frame is that of the
# arm's root link unless arm.base_pose of the site file says otherwise; z is up.

frame: world
margin_m: 0.10                  # keep-out distance round every object that names none of its own

objects:
  # TODO the ground at the lowest point of what does not move: put it where it is. The links that
  # stand on it may touch it; name those too that work in it, such as a bucket.
  - name: ground
    type: halfspace
    normal: [0, 0, 1]
    offset_m: {ground:g}
    ignore_links: {links}

  # Examples; take away the "#" and correct the numbers.
  # - {{name: wall, type: box, size: [0.2, 4.0, 2.5], pose: {{xyz: [2, 0, 1.25]}}}}
  # - {{name: tank, type: cylinder, radius_m: 0.6, height_m: 2.0, pose: {{xyz: [1.5, 1.5, 1.0]}}}}
  # - {{name: power-line, type: capsule, from: [4, -9, 6], to: [4, 9, 6], radius_m: 0.05,
  #    margin_m: 2.5}}
  # - {{name: rack, type: mesh, file: rack.stl, pose: {{xyz: [0, 1.2, 0]}}}}
  # - {{name: slew-left, type: actuator_limit, actuator: NAME, above: 1.2}}
"""


def relative(folder: Path, file: Path) -> str:
    """``file`` as seen from ``folder``, both with links resolved."""
    return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()


def _ros2(said: Mapping[str, Said]) -> CommentedMap:
    block = CommentedMap({key: value.value for key, value in said.items()})
    for key, value in said.items():
        block.yaml_add_eol_comment(value.comment, key=key)
    return block


def _arm(said: SiteText) -> CommentedMap:
    arm = CommentedMap(urdf=said.urdf)
    if said.package_dirs:
        arm["package_dirs"] = _flow(said.package_dirs)
    arm["actuators"] = CommentedSeq(_actuator(plan, said) for plan in said.plans)
    return arm


def _actuator(plan: ActuatorPlan, said: SiteText) -> CommentedMap:
    one = CommentedMap(name=plan.name, joint=plan.joint.name)
    if plan.seen is not None:
        one.yaml_add_eol_comment(f"seen at {plan.range}", key="name")
    if not said.order_sure:
        one.yaml_add_eol_comment("TODO messages name no joints: in the URDF's order", key="joint")
    if plan.drive is not None:
        one["drive"] = _flow_map({"type": "cylinder", **plan.drive})
        one.yaml_add_eol_comment("given", key="drive")
    values = {
        "axis": plan.axis,
        "sign": plan.sign,
        "max_velocity": plan.max_velocity,
        "max_deceleration": plan.max_deceleration,
        "lag_s": plan.lag_s,
        "deadband": plan.deadband,
    }
    if plan.drive is None and plan.unit == "m":
        one["unit"] = "m"
    for key, value in values.items():
        one[key] = value.value
        unit = f"[{plan.unit}{_UNITS[key]}] " if key in _UNITS else ""
        one.yaml_add_eol_comment(unit + _line(value.comment), key=key)
    if plan.limits is not None:
        one["limits"] = _flow_map(plan.limits.value)
        one.yaml_add_eol_comment(f"[{plan.unit}] {_line(plan.limits.comment)}", key="limits")
    if plan.problems:
        notes = "\n".join(f"TODO {_line(problem)}" for problem in plan.problems)
        one.yaml_set_comment_before_after_key("axis", before=notes, indent=6)
    return one


def _log(columns: Mapping[str, Any], names: Sequence[str]) -> CommentedMap:
    log = CommentedMap(time=_column(columns["time"]))
    for part in ("joystick", "actuators"):
        given = columns[part]
        log[part] = CommentedMap({n: _column(c) for n, c in zip(names, given, strict=True)})
    return log


def _column(column: ColumnMap) -> Any:
    if column.scale == 1.0 and column.offset == 0.0:
        return column.column
    return _flow_map({"column": column.column, "scale": column.scale, "offset": column.offset})


def _flow(items: Sequence[str]) -> CommentedSeq:
    seq = CommentedSeq(items)
    seq.fa.set_flow_style()
    return seq


def _flow_map(items: Mapping[str, Any]) -> CommentedMap:
    found = CommentedMap(items)
    found.fa.set_flow_style()
    return found


def _line(text: str) -> str:
    """One line of a comment, whatever is in the text."""
    return "".join(c if c.isprintable() else " " for c in text)


def _dumped(root: CommentedMap) -> str:
    yaml = YAML()
    yaml.width = _WIDTH
    yaml.indent(mapping=2, sequence=4, offset=2)
    out = io.StringIO()
    yaml.dump(root, out)
    return out.getvalue()
