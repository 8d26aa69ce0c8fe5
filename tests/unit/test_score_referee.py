"""The referee, on a sweeper whose geometry is known in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.assembly import load_machine
from rampe_guard.core.types import Certificate, FloatArray, Placement, SweepResult, ZoneSweep
from rampe_guard.evaluate.referee import Referee
from rampe_guard.settings import load_site


class WallAtOne:
    """Contact while the first actuator is at 1.0 or above; no answer above 5.0."""

    def sweep(
        self,
        start: FloatArray,
        displacement: FloatArray,
        *,
        any_path: bool = False,
        clearance: bool = True,
        wider_m: float = 0.0,
        only: frozenset[str] | None = None,
        placed: Mapping[str, Placement | None] | None = None,
    ) -> SweepResult:
        del any_path, clearance, wider_m, only, placed
        a, b = float(start[0]), float(start[0] + displacement[0])
        kind, fraction = Certificate.FREE, None
        if max(a, b) >= 5.0:
            kind = Certificate.UNKNOWN
        elif max(a, b) >= 1.0:
            kind = Certificate.CONTACT
            fraction = 0.0 if a >= 1.0 else (1.0 - a) / (b - a)
        zone = ZoneSweep("wall", kind, fraction, "bucket", None, None, 1.0 - a, closing=b > a)
        return SweepResult((zone,))


def run(values: list[float]) -> Referee:
    referee = Referee(WallAtOne())
    for i, value in enumerate(values):
        referee.feed(i * 0.1, np.array([value]))
    return referee


def test_an_entry_is_timed_between_the_samples() -> None:
    (contact,) = run([0.0, 0.8, 1.2, 0.4, 0.0]).contacts
    assert contact.entered_s == pytest.approx(0.15)
    assert contact.left_s == pytest.approx(0.3)
    assert not contact.unknown


def test_events_tell_entry_and_exit_once_each() -> None:
    referee = Referee(WallAtOne())
    told = [
        (event.entered, event.time_s)
        for i, value in enumerate([0.8, 1.2, 1.4, 1.2, 0.4, 0.2])
        for event in referee.feed(i * 0.1, np.array([value]))
    ]
    assert [entered for entered, _ in told] == [True, False]
    assert [time_s for _, time_s in told] == pytest.approx([0.05, 0.4])
    assert referee.inside == frozenset()


def test_an_arm_that_starts_inside_is_inside_from_the_first_sample() -> None:
    referee = run([1.5])
    assert referee.inside == {"wall"}
    assert referee.contacts[0].entered_s == 0.0
    assert referee.contacts[0].left_s is None


def test_in_and_out_again_between_two_sweeps_is_two_contacts() -> None:
    contacts = run([0.8, 1.2, 0.8, 1.2, 0.8, 0.8]).contacts
    assert [c.entered_s for c in contacts] == pytest.approx([0.05, 0.25])


def test_no_answer_counts_as_contact_and_is_marked() -> None:
    (contact,) = run([0.0, 6.0, 0.0, 0.0]).contacts
    assert contact.unknown
    assert contact.entered_s == 0.0


def test_no_answer_within_a_contact_marks_it_and_does_not_end_it() -> None:
    (contact,) = run([0.0, 1.5, 6.0, 1.5, 0.0, 0.0]).contacts
    assert contact.unknown
    assert contact.left_s == pytest.approx(0.4)


def test_unfit_samples_are_refused() -> None:
    referee = run([0.0, 0.1])
    with pytest.raises(ValueError, match="does not follow"):
        referee.feed(0.1, np.array([0.2]))
    with pytest.raises(ValueError, match="finite"):
        referee.feed(0.2, np.array([np.nan]))


def test_on_the_demo_machine_a_swing_too_far_is_a_contact_with_the_wall() -> None:
    site = load_site(Path(__file__).parents[2] / "config" / "sites" / "demo.yaml")
    referee = Referee(load_machine(site).sweeper)
    for i, swing in enumerate([1.2, 1.35, 1.5, 1.65, 1.5, 1.35]):
        referee.feed(i * 0.2, np.array([swing, 0.88, 0.38, 0.52]))
    (contact,) = referee.contacts
    assert contact.zone == "wall"
    assert not contact.unknown
    assert 0.4 < contact.entered_s < 0.6
    assert contact.left_s == pytest.approx(0.8)


def test_trembling_at_the_edge_is_one_contact() -> None:
    referee = run([0.5, 1.0001, 0.9999, 1.0001, 0.9998, 1.0002, 0.5, 0.5])
    assert len(referee.contacts) == 1
    assert referee.contacts[0].left_s is not None
