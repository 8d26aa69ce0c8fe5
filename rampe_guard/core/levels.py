"""From sweeps and probabilities to levels: how urgent is it, zone by zone.

============  =========================================================================
imminent      the arm will touch whatever the operator does; or the stopping path touches, with
              at least the imminent probability; or contact has at least the warning probability
              sooner than the operator can react and stop
warning       contact has at least the warning probability
caution       contact has at least the caution probability, or comes later than the horizon
============  =========================================================================

The probability is that of `risk`: what the present motion says and what memory says, in one. An
operator who is not known yet has no memory that could speak against the stopping path, so for
him its touch is imminent.

Moving away is always allowed: inside a margin, only a path that closes in counts. A sweep
that could not be computed counts as contact at the first fraction it could not certify.
A level already shown is kept a little below its threshold (deadbands), so that noise at a
threshold does not make an alert come and go.
"""

from __future__ import annotations

from dataclasses import dataclass

from rampe_guard.core.alarm import Level, urgency
from rampe_guard.core.config import AlertConfig
from rampe_guard.core.events import Evidence, Source
from rampe_guard.core.forecast import StoppingForecast
from rampe_guard.core.risk import ZoneRisk
from rampe_guard.core.types import Certificate, ZoneSweep

_DEADBAND_SHARE = 0.4
"""A deadband of the probability is no larger than this share of its threshold."""


@dataclass(frozen=True, slots=True)
class LevelRules:
    """Thresholds of the alert settings."""

    alerts: AlertConfig

    def stopping(
        self, forecast: StoppingForecast, sweep: ZoneSweep, risk: ZoneRisk, shown: Level
    ) -> Evidence:
        """Evidence of the stopping path about one zone.

        Args:
            forecast: the swept forecast.
            sweep: what the sweep proved of the zone.
            risk: its probability of contact.
            shown: the level that the zone's alert shows now.
        """
        source: Source = "contact" if sweep.inside else "stopping"
        if sweep.certificate is Certificate.FREE:
            return Evidence(self._near(sweep, shown, Level.IMMINENT), source, 0.0, None, sweep)
        if sweep.inside and not sweep.closing:
            # who stands in an object, or past a limit, is not clear of it; who leaves it is not
            # alarmed anew
            standing = not forecast.displacement.any()
            held = (sweep.touching or sweep.past_limit) and (bool(shown) or standing)
            level = Level.CAUTION if held else Level.CLEAR
            return Evidence(level, source, 0.0, None, sweep)
        time_s = forecast.time_at(sweep.contact_fraction or 0.0)
        least = self._least(self.alerts.imminent_probability, shown >= Level.IMMINENT)
        known = sweep.certificate is Certificate.CONTACT
        if known and not risk.floor and not sweep.inside and risk.instant < least:
            return Evidence(Level.CLEAR, source, risk.instant, time_s, sweep)
        return Evidence(Level.IMMINENT, source, risk.instant, time_s, sweep)

    def foreseen(self, sweep: ZoneSweep, risk: ZoneRisk, shown: Level, stop_s: float) -> Evidence:
        """Evidence of what is foreseen about one zone.

        Args:
            sweep: of the forecast that says most of it.
            risk: its probability of contact.
            shown: the level that the zone's alert shows now.
            stop_s: time to react and to stop from the present motion [s].
        """
        if sweep.certificate is Certificate.FREE:
            return Evidence(self._near(sweep, shown, Level.WARNING), risk.source, 0.0, None, sweep)
        level = self._foreseen_level(risk, shown, stop_s)
        return Evidence(level, risk.source, risk.probability, risk.time_s, sweep)

    def _foreseen_level(self, risk: ZoneRisk, shown: Level, stop_s: float) -> Level:
        alerts = self.alerts
        warning = alerts.warning_probability
        time_s = 0.0 if risk.time_s is None else risk.time_s
        if risk.soon >= self._least(warning, shown >= Level.IMMINENT):
            slack_s = alerts.deadband_s if shown >= Level.IMMINENT else 0.0
            if time_s <= stop_s + slack_s:
                return Level.IMMINENT
        if risk.probability >= self._least(warning, shown >= Level.WARNING):
            slack_s = alerts.deadband_s if shown >= Level.WARNING else 0.0
            near = time_s <= alerts.horizon_s + slack_s
            return Level.WARNING if near else Level.CAUTION
        if risk.probability >= self._least(alerts.caution_probability, shown >= Level.CAUTION):
            return Level.CAUTION
        return Level.CLEAR

    def grazes(self, sweep: ZoneSweep) -> bool:
        """Whether a free path is not known to keep clear of the deadband."""
        clearance = sweep.clearance_m
        free = sweep.certificate is Certificate.FREE
        return free and clearance is not None and clearance < self.alerts.deadband_m

    def _near(self, sweep: ZoneSweep, shown: Level, highest: Level) -> Level:
        """A free path that passes within the deadband keeps the level that is shown."""
        grazing = self.grazes(sweep) and sweep.closing
        return min(shown, highest) if grazing and shown else Level.CLEAR

    def _least(self, threshold: float, held: bool) -> float:
        """The probability that a level needs, less if it is shown already."""
        if not held:
            return threshold
        return threshold - min(self.alerts.deadband_probability, _DEADBAND_SHARE * threshold)


def worst(items: list[Evidence]) -> Evidence:
    """The most urgent evidence; among equals the soonest."""
    return min(items, key=lambda e: urgency(e.level, e.time_to_collision_s))
