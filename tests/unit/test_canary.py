"""The canary's answers are right for every arm, and whoever lies to it is found out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import fcl
import numpy as np
import pytest

from rampe_guard.collision import FclSweeper, load_arm
from rampe_guard.collision.canary import Canary
from rampe_guard.core import sweep as sweep_module
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.types import Certificate, SweepResult, ZoneSweep
from rampe_guard.errors import GeometryError
from rampe_guard.settings import load_site
from tests.support.processes import BENCH, DEMO


def canary_of(site_path: Path) -> Canary:
    site = load_site(site_path)
    return Canary(load_arm(site.arm), site.sweep)


@pytest.fixture(scope="module")
def sound() -> Canary:
    """To be spoilt by monkeypatching only."""
    return canary_of(BENCH)


@pytest.mark.parametrize("site_path", [BENCH, DEMO], ids=lambda path: path.stem)
def test_all_is_right(site_path: Path) -> None:
    canary = canary_of(site_path)
    assert canary.check() is None
    assert canary.check() is None
    known = canary._known
    # the questions are sharp: contact is known to a fraction, the gap to a share of it
    assert 0.0 < known.earliest < known.latest < 1.0
    assert known.latest - known.earliest < 0.1
    assert 0.25 * known.gap < known.least < known.gap <= known.most < 1.001 * known.gap


@pytest.mark.parametrize("tolerance_m", [1e-4, 1e-3, 1e-2])
def test_all_is_right_at_any_tolerance_and_budget(tolerance_m: float) -> None:
    site = load_site(BENCH)
    config = replace(site.sweep, tolerance_m=tolerance_m, max_queries=1)
    assert Canary(load_arm(site.arm), config).check() is None


@pytest.mark.parametrize(
    "limits", [(-np.inf, np.inf), (1.0, np.inf), (-np.inf, -1.0), (0.3, 0.3)], ids=str
)
def test_all_is_right_where_travel_has_no_end_or_no_length(limits: tuple[float, float]) -> None:
    arm = load_arm(load_site(BENCH).arm)
    changed = arm.limits.copy()
    changed[0] = limits
    proven = arm.proven.copy()
    proven[0] = limits
    assert Canary(replace(arm, limits=changed, proven=proven)).check() is None


def test_an_arm_that_nobody_moves_is_tried_too() -> None:
    arm = load_arm(load_site(BENCH).arm)
    middle = np.repeat(arm.limits.mean(axis=1)[:, None], 2, axis=1)
    assert Canary(replace(arm, limits=middle)).check() is None


def test_an_arm_without_meshes_is_refused() -> None:
    arm = load_arm(load_site(BENCH).arm)
    with pytest.raises(GeometryError, match="no link with a mesh"):
        Canary(replace(arm, meshes=(None,) * len(arm.meshes)))


Lie = Callable[[ZoneSweep], ZoneSweep]


def free(zone: ZoneSweep) -> ZoneSweep:
    return replace(zone, certificate=Certificate.FREE, contact_fraction=None, clearance_m=0.01)


LIES: list[tuple[str, Lie, str]] = [
    ("hit", free, "called a sure contact free"),
    ("hit", lambda z: replace(z, certificate=Certificate.UNKNOWN), "a sure contact unknown"),
    ("hit", lambda z: replace(z, contact_fraction=0.76), "put a contact at 0.7600"),
    ("hit", lambda z: replace(z, contact_fraction=0.5), "put a contact at 0.5000"),
    ("hit", lambda z: replace(z, contact_fraction=float("nan")), "put a contact at nan"),
    ("hit", lambda z: replace(z, link="base"), "named link base where bucket touches"),
    ("miss", lambda z: replace(z, certificate=Certificate.CONTACT), "called a free way contact"),
    ("miss", lambda z: replace(z, certificate=Certificate.UNKNOWN), "called a free way unknown"),
    ("miss", lambda z: replace(z, clearance_m=(z.clearance_m or 0) + 0.01), "the sweep measured"),
    ("miss", lambda z: replace(z, clearance_m=0.0), "the sweep measured 0 m"),
    ("miss", lambda z: replace(z, clearance_m=float("nan")), "the sweep measured nan"),
    ("miss", lambda z: replace(z, zone="hit"), "answered about ['hit', 'hit']"),
]


@pytest.mark.parametrize(("zone", "lie", "words"), LIES, ids=[words for _, _, words in LIES])
def test_a_sweep_that_lies_is_found_out(
    sound: Canary, monkeypatch: pytest.MonkeyPatch, zone: str, lie: Lie, words: str
) -> None:
    true = FclSweeper.sweep

    def lying(self: FclSweeper, *args: Any, **more: Any) -> SweepResult:
        result = true(self, *args, **more)
        zones = tuple(lie(z) if z.zone == zone else z for z in result.zones)
        return replace(result, zones=zones)

    monkeypatch.setattr(FclSweeper, "sweep", lying)
    told = sound.check()
    assert told is not None
    assert words in told


def test_a_sweep_that_sees_contact_everywhere_is_found_out(
    sound: Canary, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = FclSweeper.sweep

    def lying(self: FclSweeper, start: Any, displacement: Any) -> SweepResult:
        return true(self, start, displacement if displacement.any() else np.ones(len(start)))

    monkeypatch.setattr(FclSweeper, "sweep", lying)
    told = sound.check()
    assert told is not None
    assert "an arm that stands clear" in told


def test_kernels_that_do_nothing_are_found_out(
    sound: Canary, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert sound.check() is None  # so there are true answers to repeat
    monkeypatch.setattr(sweep_module, "search", lambda *_: None)
    assert sound.check() == "the sweep called a sure contact free"


@pytest.mark.parametrize(
    ("name", "lie", "words"),
    [
        ("collide", lambda *_: 0, "FCL collide called the hit apart"),
        ("collide", lambda *_: 1, "FCL collide called the miss in contact"),
        ("distance", lambda *_: 1.7976931348623157e308, "FCL distance said 1.79769e+308 m"),
        ("distance", lambda *_: 0.0, "FCL distance said 0 m"),
        ("distance", lambda *_: float("nan"), "FCL distance said nan m"),
    ],
)
def test_an_fcl_that_lies_is_found_out(
    sound: Canary,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    lie: Callable[..., float],
    words: str,
) -> None:
    # the sweep is left alone: this is about FCL itself
    monkeypatch.setattr(sound, "_swept", lambda: None)
    monkeypatch.setattr(fcl, name, lie)
    told = sound.check()
    assert told is not None
    assert words in told


def test_whatever_is_raised_is_a_wrong_answer(
    sound: Canary, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: object) -> None:
        raise ZeroDivisionError("no room left")

    monkeypatch.setattr(sweep_module, "search", failing)
    assert sound.check() == "the test motion raised ZeroDivisionError: no room left"
    monkeypatch.undo()
    assert sound.check() is None


def test_the_default_settings_serve() -> None:
    arm = load_arm(load_site(BENCH).arm)
    assert Canary(arm).check() is None
    assert Canary(arm, SweepConfig()).check() is None
