"""Holds one sweep against the dense search, zone by zone, and names what is not as promised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.types import Certificate
from tests.support.motion import Motion
from tests.support.obstacles import ERROR_M
from tests.support.search import Sample, ZoneTruth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.types import FloatArray, SweepResult, ZoneSweep
    from tests.support.dense import DenseArm
    from tests.support.obstacles import Obstacle

ROUNDING_M = 1e-6
"""Sums of rounding errors along a chain of 10 m, and of FCL's exact pairs [m]."""
SLACK_M = 1e-5
"""By how much a clearance may be below its tolerance: error bounds that a proof must add [m]."""
COMPLETE = 2.0
"""A contact must be within so many tolerances of a touch, or it is false."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """One zone of one motion.

    Attributes:
        zone: its name.
        certificate: what the sweep said.
        touches: whether the exact shapes (with margin) touch; None where nobody had to know.
        faults: kinds of broken promises: missed, false, late, early, clearance, loose, now,
            place, unknown.
        detail: the faults in figures.
        early_m: motion of the touching link from the called to the true contact [m].
        over_m: how far the clearance named is above what was measured [m] (a fault if > 0).
        under_m: how far it is below the least that was measured [m].
    """

    zone: str
    certificate: Certificate
    touches: bool | None
    faults: tuple[str, ...] = ()
    detail: str = ""
    early_m: float | None = None
    over_m: float | None = None
    under_m: float | None = None


class Referee:
    """Truth about one motion, asked for as far as claims need it; both ways share it."""

    def __init__(
        self,
        arm: DenseArm,
        obstacles: Sequence[Obstacle],
        start: FloatArray,
        displacement: FloatArray,
        config: SweepConfig,
    ) -> None:
        self._motion = Motion(arm, np.asarray(start), np.asarray(displacement))
        self.truths = [ZoneTruth(arm, self._motion, obstacle) for obstacle in obstacles]
        self._config = config

    def judge(
        self, result: SweepResult, *, backwards: bool = False, sharp: bool = True
    ) -> list[Verdict]:
        """One verdict per obstacle; ``sharp`` if the sweep was asked for sharp clearances."""
        claims = {zone.zone: zone for zone in result.zones}
        return [
            self._zone(truth, claims[truth.obstacle.item.name], backwards=backwards, sharp=sharp)
            for truth in self.truths
        ]

    def _zone(self, truth: ZoneTruth, claim: ZoneSweep, *, backwards: bool, sharp: bool) -> Verdict:
        begin = 1.0 if backwards else 0.0
        faults = [] if truth.contained(begin) else self._now(truth, claim, begin)
        if claim.certificate is Certificate.FREE:
            verdict = self._free(truth, claim, begin, sharp=sharp)
        else:
            verdict = self._contact(truth, claim, begin, backwards=backwards)
        if not faults:
            return verdict
        return Verdict(
            verdict.zone,
            verdict.certificate,
            verdict.touches,
            (*verdict.faults, "now"),
            "; ".join([*faults, verdict.detail]),
            verdict.early_m,
            verdict.over_m,
            verdict.under_m,
        )

    def _now(self, truth: ZoneTruth, claim: ZoneSweep, begin: float) -> list[str]:
        now, margin = claim.clearance_now_m, truth.obstacle.item.margin_m
        if now is None:
            return []
        level = now + margin - ROUNDING_M
        for link in truth.links:
            if truth.below_at(link, begin, level):
                found = truth.distance(link, begin) - margin
                return [f"clearance_now {now:.6f} m, but {link} is at {found:.6f} m"]
        return []

    def _free(self, truth: ZoneTruth, claim: ZoneSweep, begin: float, *, sharp: bool) -> Verdict:
        margin, said = truth.obstacle.item.margin_m, claim.clearance_m
        if said is None:
            return Verdict(claim.zone, claim.certificate, None, ("clearance",), "free without one")
        if truth.contained(begin):
            return Verdict(
                claim.zone,
                claim.certificate,
                touches=True,
                faults=("missed",),
                detail="starts inside",
            )
        found = truth.least(max(said, 0.0) + margin - ROUNDING_M)
        true, faults = found.distance - margin, []
        if true <= 0.0:
            faults.append("missed")
        elif said > true + ROUNDING_M:
            faults.append("clearance")
        if sharp and true > said + self._config.clearance_tolerance_m:
            # nothing that near was met on the search: look until it is met or excluded
            enough = said + margin + self._config.clearance_tolerance_m
            found = truth.least(enough, enough=enough)
            true = found.distance - margin
            if true > enough - margin + ERROR_M + SLACK_M:
                faults.append("loose")
        text = f"said {said:.6f} m, {_told(found, margin)}" if faults else ""
        return Verdict(
            claim.zone,
            claim.certificate,
            "missed" in faults,
            tuple(faults),
            text,
            over_m=said - true,
            under_m=(true - said) if sharp else None,
        )

    def _contact(
        self, truth: ZoneTruth, claim: ZoneSweep, begin: float, *, backwards: bool
    ) -> Verdict:
        margin, tolerance = truth.obstacle.item.margin_m, self._config.tolerance_m
        faults: list[str] = []
        unknown = claim.certificate is Certificate.UNKNOWN
        if unknown:
            faults.append("unknown")
        said = claim.contact_fraction
        called = begin if said is None else 1.0 - said if backwards else said
        if truth.contained(begin):
            first: Sample | None = Sample(0.0, begin, claim.link or truth.links[0])
        else:
            first = truth.first(margin, backwards=backwards)
        early = None
        text = f"called at {called:.9f}"
        if first is not None:
            way = self._motion.moved(first.link, called, first.fraction)
            before = called >= first.fraction if backwards else called <= first.fraction
            early = way if before else -way
            text += f", touches at {first.fraction:.9f} ({first.link}), early by {early:.9f} m"
            if early < -ROUNDING_M:
                faults.append("late")
            elif early > tolerance + ROUNDING_M and not faults:
                faults.append("early")
        elif not faults:
            near = margin + COMPLETE * tolerance
            found = truth.least(near + ERROR_M, enough=near)
            text += f", {_told(found, margin)}"
            if found.distance > near + ERROR_M:
                faults.append("false")
        if not faults and not truth.contained(begin):
            there = (
                truth.at(called)
                if claim.link is None
                else Sample(truth.distance(claim.link, called), called, claim.link)
            )
            if there.distance > margin + COMPLETE * tolerance + ERROR_M:
                faults.append("place")
                text += f", {claim.link} is then at {there.distance - margin:.6f} m"
        return Verdict(
            claim.zone,
            claim.certificate,
            first is not None,
            tuple(faults),
            text if faults else "",
            early_m=None if unknown else early,
        )


def _told(found: Sample, margin: float) -> str:
    return f"{found.link} comes to {found.distance - margin:.9f} m at {found.fraction:.9f}"
