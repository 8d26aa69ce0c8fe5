"""`FclSweeper.in_scene`: the same arm among other objects."""

from __future__ import annotations

import numpy as np
import pytest

from rampe_guard.assembly import load_machine
from rampe_guard.collision import FclSweeper
from rampe_guard.core.scene import Scene, Sphere
from rampe_guard.errors import GeometryError
from rampe_guard.settings import load_site
from tests.support.processes import BENCH

BALL = Sphere(name="ball", margin_m=0.05, radius_m=0.05, center_m=(0.3, 0.2, 0.1))


def test_it_answers_as_one_built_from_scratch_and_leaves_the_first_as_it_was() -> None:
    site = load_site(BENCH)
    first = load_machine(site).sweeper
    scene = Scene((*site.scene.objects[:2], BALL), "", "")
    second = first.in_scene(scene)
    fresh = FclSweeper(load_machine(site).arm, scene, site.sweep, site.self_collision)
    assert second.zones == fresh.zones
    assert set(first.zones) - set(second.zones) == {"slew-left", "slew-right"}
    rng = np.random.default_rng(5)
    low, high = first.arm.limits.T
    before = load_machine(site).sweeper
    for _ in range(30):
        start, end = rng.uniform(low, high, (2, len(low)))
        told = [s.sweep(start, end - start) for s in (first, second, fresh, before)]
        assert told[1].zones == told[2].zones
        assert told[0].zones == told[3].zones


def test_an_object_that_cannot_be_is_refused_by_name() -> None:
    sweeper = load_machine(load_site(BENCH)).sweeper
    bad = Sphere(name="ball", margin_m=0.05, radius_m=-1.0, center_m=(0.0, 0.0, 0.0))
    with pytest.raises(GeometryError, match="ball"):
        sweeper.in_scene(Scene((bad,), "", ""))
