"""Ours: the certified sweep, asked for the first contact alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rampe_guard.collision import FclSweeper
from rampe_guard.core.config import SweepConfig
from rampe_guard.core.scene import Scene
from rampe_guard.core.types import Certificate

if TYPE_CHECKING:
    from tests.benchmarks.peers.work import Work


class Ours:
    """`FclSweeper` as a site would have it, with the tolerance of the comparison."""

    def __init__(self, work: Work) -> None:
        scene = Scene(tuple(item.zone for item in work.items))
        machine = work.machine
        self.sweeper = FclSweeper(machine.arm, scene, SweepConfig(tolerance_m=machine.tolerance_m))
        self._motions = work.motions

    def first_contact(self, number: int) -> float | None:
        """An answer of unknown counts as contact, as it does in the guard."""
        motion = self._motions[number]
        result = self.sweeper.sweep(motion.start, motion.displacement, clearance=False, worst=True)
        fraction = result.contact_fraction
        if fraction is None and result.certificate is not Certificate.FREE:
            return 0.0
        return fraction
