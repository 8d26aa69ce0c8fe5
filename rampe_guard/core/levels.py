"""From sweeps to levels: how urgent is what the forecasts found, zone by zone.

============  =========================================================================
imminent      the stopping path touches; or the intent path touches with at least the
              warning probability and sooner than the operator can react and stop
warning       the intent path touches with at least the warning probability
caution       the intent path touches with at least the caution probability, or later
              than the horizon
============  =========================================================================

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
from rampe_guard.core.forecast import Forecast, IntentForecast, StoppingForecast
from rampe_guard.core.types import Certificate, ZoneSweep


@dataclass(frozen=True, slots=True)
class LevelRules:
    """Thresholds of the alert settings."""

    alerts: AlertConfig

    def judge(self, forecast: Forecast, sweep: ZoneSweep, shown: Level, stop_s: float) -> Evidence:
        """Evidence of one forecast about one zone.

        Args:
            forecast: the swept forecast.
            sweep: what the sweep proved of the zone.
            shown: the level that the zone's alert shows now.
            stop_s: time to react and to stop from the present motion [s].
        """
        touched = sweep.certificate is not Certificate.FREE
        if not touched:
            return self._near(forecast, sweep, shown)
        fraction = sweep.contact_fraction or 0.0
        probability = forecast.probability_at(fraction)
        time_s = forecast.time_at(fraction)
        if sweep.inside and not sweep.closing:
            # who stands in an object is not clear of it; who leaves it is not alarmed anew
            standing = not forecast.displacement.any()
            held = sweep.touching and (bool(shown) or standing)
            level = Level.CAUTION if held else Level.CLEAR
            return Evidence(level, _source(forecast, sweep), 0.0, None, sweep)
        if isinstance(forecast, StoppingForecast):
            return Evidence(Level.IMMINENT, _source(forecast, sweep), 1.0, time_s, sweep)
        level = self._intent_level(probability, time_s, shown, stop_s)
        return Evidence(level, "intent", probability, time_s, sweep)

    def _intent_level(
        self, probability: float, time_s: float, shown: Level, stop_s: float
    ) -> Level:
        alerts = self.alerts

        def slack(level: Level, band: float) -> float:
            return band if shown >= level else 0.0

        band = alerts.deadband_probability
        if probability >= alerts.warning_probability - slack(Level.WARNING, band):
            if time_s <= stop_s + slack(Level.IMMINENT, alerts.deadband_s):
                return Level.IMMINENT
            near = time_s <= alerts.horizon_s + slack(Level.WARNING, alerts.deadband_s)
            return Level.WARNING if near else Level.CAUTION
        if probability >= alerts.caution_probability - slack(Level.CAUTION, band):
            return Level.CAUTION
        return Level.CLEAR

    def grazes(self, sweep: ZoneSweep) -> bool:
        """Whether a free path is not known to keep clear of the deadband."""
        clearance = sweep.clearance_m
        free = sweep.certificate is Certificate.FREE
        return free and clearance is not None and clearance < self.alerts.deadband_m

    def _near(self, forecast: Forecast, sweep: ZoneSweep, shown: Level) -> Evidence:
        """A free path that passes within the deadband keeps the level that is shown."""
        grazing = self.grazes(sweep) and sweep.closing
        highest = Level.IMMINENT if isinstance(forecast, StoppingForecast) else Level.WARNING
        level = min(shown, highest) if grazing and shown else Level.CLEAR
        return Evidence(level, _source(forecast, sweep), 0.0, None, sweep)


def worst(items: list[Evidence]) -> Evidence:
    """The most urgent evidence; among equals the soonest."""
    return min(items, key=lambda e: urgency(e.level, e.time_to_collision_s))


def _source(forecast: Forecast, sweep: ZoneSweep) -> Source:
    if sweep.inside:
        return "contact"
    return "intent" if isinstance(forecast, IntentForecast) else "stopping"
