"""What tools of ROS 2 are shown of a guard; most of all, when nobody watches."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from rampe_guard import wire
from rampe_guard.collision import load_arm
from rampe_guard.core.scene import ActuatorLimit, Box, Capsule, Cylinder, Halfspace, Sphere
from rampe_guard.ros2 import cdr
from rampe_guard.ros2.diagnostics import Grade, diagnostics
from rampe_guard.ros2.markers import MOST_ZONES, Painter
from rampe_guard.ros2.shapes import Ghost, zones
from rampe_guard.settings import load_site
from rampe_guard.settings.ros2_keys import DIAGNOSTICS, MARKERS
from tests.support.messages import ALERT, STATE, SWINGING
from tests.support.processes import BENCH

SITE = load_site(BENCH)
NAMES = SITE.actuator_names
HERE = dict(zip(NAMES, (1.0, 0.065, 0.08, 0.03), strict=True))


@pytest.fixture(scope="module")
def painter() -> Painter:
    return Painter(Ghost(load_arm(SITE.arm)), NAMES, "map")


def state(status: str = "ok", reasons: tuple[str, ...] = (), **fields: Any) -> wire.State:
    told = tuple(wire.Reason(code=code, text=f"because of {code}", key=None) for code in reasons)
    beat = structs.replace(STATE.heartbeat, status=status, reasons=told)
    return structs.replace(STATE, heartbeat=beat, **{"alerts": (), "predictions": (), **fields})


def grades(of: wire.State | None) -> tuple[Grade, Grade]:
    array = diagnostics(of, "rampe_guard", "e7", 1e9, {"joystick": 3}, "it is gone")
    again = cdr.decode(cdr.encode(array, DIAGNOSTICS), DIAGNOSTICS)
    first, second = again.status
    assert first.hardware_id == "e7"
    return Grade(first.level), Grade(second.level)


def test_only_a_guard_that_monitors_is_ever_ok() -> None:
    loud = structs.replace(ALERT, level="imminent")
    mild = structs.replace(ALERT, level="caution")
    over = structs.replace(ALERT, level="clear")
    assert grades(state()) == (Grade.OK, Grade.OK)
    assert grades(state(alerts=(over,))) == (Grade.OK, Grade.OK)
    assert grades(state(alerts=(mild,))) == (Grade.OK, Grade.WARN)
    assert grades(state(alerts=(mild, loud))) == (Grade.OK, Grade.ERROR)
    assert grades(state("degraded", ("slow",))) == (Grade.WARN, Grade.OK)
    assert grades(state("not_monitoring", ("joystick_silent",))) == (Grade.ERROR, Grade.STALE)
    assert grades(state("not_monitoring", ("machine_off",))) == (Grade.STALE, Grade.STALE)
    both = ("machine_off", "actuators_silent")
    assert grades(state("not_monitoring", both)) == (Grade.ERROR, Grade.STALE)
    assert grades(None) == (Grade.ERROR, Grade.STALE)


def test_every_kind_of_zone_is_drawn_where_it_is(painter: Painter) -> None:
    pose = np.eye(4)
    pose[:3, 3] = (1.0, 2.0, 3.0)
    objects = (
        Box(name="box", margin_m=0.1, size_m=(1.0, 2.0, 3.0), pose=pose),
        Sphere(name="ball", margin_m=0.1, radius_m=0.5, center_m=(1.0, 2.0, 3.0)),
        Cylinder(name="can", margin_m=0.1, radius_m=0.5, height_m=2.0, pose=pose),
        Capsule(name="rod", margin_m=0.0, radius_m=0.5, start_m=(0, 0, 0), end_m=(0, 4.0, 0)),
        Halfspace(name="floor", margin_m=0.0, normal=(0.0, 0.0, 1.0), offset_m=-1.0),
        ActuatorLimit(name="slew", actuator=0, above=1.0),
    )
    solids = zones(objects, 10.0)
    assert {name: len(parts) for name, parts in solids.items()} == {
        "box": 1,
        "ball": 1,
        "can": 1,
        "rod": 3,
        "floor": 1,
    }
    rod = solids["rod"][2]
    np.testing.assert_allclose(rod.pose[:3, 2], (0.0, 1.0, 0.0), atol=1e-12)
    assert (rod.size, rod.pose[1, 3]) == ((1.0, 1.0, 4.0), 2.0)
    floor = solids["floor"][0]
    assert floor.pose[2, 3] + floor.size[2] / 2 == pytest.approx(-1.0)
    moving = replace(objects[1], key="a/b", max_speed=1.0)
    assert zones((moving,), 10.0) == {}

    array = painter.zones(
        state(alerts=(structs.replace(ALERT, zone="can", level="imminent"),)), solids, 5.0
    )
    again = cdr.decode(cdr.encode(array, MARKERS), MARKERS, 4_000_000)
    bodies = [m for m in again.markers if m.ns == "zones"]
    assert len(bodies) == 7
    assert len({m.id for m in bodies}) == 7
    (red,) = [m for m in bodies if m.color.r > 0.85 and m.color.g < 0.2]
    assert (red.type, red.scale.z, red.header.frame_id) == (3, 2.0, "map")
    assert any(m.text == ALERT.text for m in again.markers)


def test_nobody_watching_has_no_colours(painter: Painter) -> None:
    solids = zones(SITE.scene.objects, 3.0)
    loud = structs.replace(ALERT, zone="crate", level="imminent")
    for blind in (None, state("not_monitoring", ("joystick_silent",), alerts=(loud,))):
        markers = painter.zones(blind, solids, 5.0).markers
        assert any(m.text == "NOT MONITORING" for m in markers)
        assert len({(m.color.r, m.color.g, m.color.b) for m in markers if m.ns == "zones"}) == 1
    assert not any(m.text == "NOT MONITORING" for m in painter.zones(state(), solids, 5.0).markers)


def test_the_way_is_where_the_operator_usually_goes(painter: Painter) -> None:
    end = {**HERE, "swing": 0.2}
    way = structs.replace(SWINGING, event="started", endpoints=(), endpoint=end)
    shown = painter.way(state(position=HERE, predictions=(way,)), 5.0)
    assert shown is not None
    markers = shown.markers
    expected = painter.ghost.at(np.array([end[name] for name in NAMES]))
    assert len(markers) == len(expected) >= 4
    for marker, solid in zip(markers, expected, strict=True):
        np.testing.assert_allclose(
            [marker.pose.position.x, marker.pose.position.y], solid.pose[:2, 3]
        )
    two = tuple(wire.Endpoint(position={**HERE, "swing": s}, share=0.5) for s in (0.1, 0.9))
    both = structs.replace(way, endpoints=two)
    forked = painter.way(state(position=HERE, predictions=(both,)), 5.0)
    assert forked is not None
    assert len(forked.markers) == 2 * len(markers)
    ended = structs.replace(way, event="ended")
    for none in (
        state(position=HERE),
        state(position=None, predictions=(way,)),
        state(position=HERE, predictions=(ended,)),
        state("not_monitoring", ("joystick_silent",), position=HERE, predictions=(way,)),
    ):
        assert painter.way(none, 5.0) is None


def test_a_large_scene_is_drawn_with_its_alerts_first(painter: Painter) -> None:
    crowd = tuple(
        Sphere(name=f"s{i}", margin_m=0.0, radius_m=0.1, center_m=(i, 0.0, 0.0)) for i in range(999)
    )
    loud = structs.replace(ALERT, zone="s998", level="imminent")
    markers = painter.zones(state(alerts=(loud,)), zones(crowd, 3.0), 5.0).markers
    bodies = [m for m in markers if m.ns == "zones"]
    assert len(bodies) == MOST_ZONES
    assert bodies[0].pose.position.x == 998.0
