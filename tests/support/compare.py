"""Holds one sweep against dense sampling; used by the tests and by tests/benchmarks/oracle.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rampe_guard.core.scene import Mesh, SolidObject
from rampe_guard.core.types import Certificate
from tests.support.dense import DenseArm, farthest_motion, first_contacts

if TYPE_CHECKING:
    from rampe_guard.collision import FclSweeper
    from rampe_guard.core.types import FloatArray, ZoneSweep

EARLY_M = 0.010
LATE_M = 0.003
NEAR_M = 0.0005


@dataclass(frozen=True, slots=True)
class Verdict:
    """One zone of one motion.

    ``wrong`` says what is not as it must be; ``early_m`` how much motion before the dense
    contact the sweep called it, where both did.
    """

    zone: str
    certificate: Certificate
    wrong: str | None
    early_m: float | None = None


def compare(
    sweeper: FclSweeper,
    arm: DenseArm,
    items: list[SolidObject],
    start: FloatArray,
    displacement: FloatArray,
) -> list[Verdict]:
    """One verdict per zone."""
    result = sweeper.sweep(start, displacement)
    dense = first_contacts(arm, items, start, displacement)
    verdicts = []
    for item, zone, found in zip(items, result.zones, dense, strict=True):
        early = None
        wrong = None
        if zone.certificate is Certificate.UNKNOWN:
            wrong = "unknown within the budget"
        elif zone.certificate is Certificate.FREE:
            wrong = None if found is None else f"free, but {found} touches"
        elif found is None:
            wrong = _invented(arm, item, zone, start, displacement)
        else:
            assert zone.contact_fraction is not None
            a, b = sorted((zone.contact_fraction, found.fraction))
            motion = max(
                farthest_motion(arm, link, start, displacement, a, b)
                for link in {found.link, zone.link or found.link}
            )
            early = motion if zone.contact_fraction <= found.fraction else -motion
            if early < -1e-9:
                wrong = f"called {-early} m after {found}"
            elif early > EARLY_M:
                wrong = f"called {early} m before {found}: {zone}"
        verdicts.append(Verdict(zone.zone, zone.certificate, wrong, early))
    return verdicts


def _invented(
    arm: DenseArm,
    item: SolidObject,
    zone: ZoneSweep,
    start: FloatArray,
    displacement: FloatArray,
) -> str | None:
    """A contact that dense sampling misses must be a near touch."""
    if isinstance(item, Mesh):
        return None  # cannot be grown; the sampling may step over a corner too
    near = first_contacts(arm, [item], start, displacement, grow=NEAR_M)[0]
    return None if near is not None else f"contact, but nothing within {NEAR_M} m: {zone}"
