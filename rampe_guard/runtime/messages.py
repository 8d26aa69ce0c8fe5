"""Core events and snapshots to messages of the contract.

The core's clock has no epoch; `Scribe` is told how to turn its times into Unix times. An
offline replay passes the log's own time through, so its output never depends on the day.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rampe_guard import wire
from rampe_guard.core.advice import Advice
from rampe_guard.core.alarm import Inhibit, Level, State
from rampe_guard.core.events import (
    SYSTEM_ZONE,
    AdviceEvent,
    AlertEvent,
    PredictionEvent,
    PredictionSummary,
    SweepSummary,
)
from rampe_guard.core.foresight import Outlook
from rampe_guard.core.guard import Snapshot
from rampe_guard.core.types import FloatArray, Point, ZoneSweep
from rampe_guard.settings import Site


@dataclass(frozen=True, slots=True)
class Scribe:
    """Writes the messages of one guard.

    Attributes:
        site: whose guard it is.
        boot_id: of this run.
        unix_s: Unix time [s] of a time on the core's clock.
        start_s: when the guard booted, on that clock [s]; None offline.
    """

    site: Site
    boot_id: str
    unix_s: Callable[[float], float]
    start_s: float | None = None

    def alert(self, event: AlertEvent, compute_ms: float | None = None) -> wire.Alert:
        """An alert event as ``rampe.alert.v1``."""
        found, sweep, told = event.evidence, event.evidence.sweep, event.prediction
        clear = event.level is Level.CLEAR
        zone = None if event.zone == SYSTEM_ZONE else event.zone
        times = (found.met, found.similar) if found.similar and not clear else None
        return wire.Alert(
            alert_id=event.alert_id,
            boot_id=self.boot_id,
            seq=event.seq,
            site=self.site.name,
            machine=self.site.machine,
            source=found.source,
            inhibit=event.inhibit.value,
            quality=event.quality,
            zone=zone,
            link=event.link,
            probability=None if clear else found.probability,
            time_to_collision_s=None if clear else found.time_to_collision_s,
            clearance_m=None if sweep is None else sweep.clearance_m,
            clearance_now_m=None if sweep is None else sweep.clearance_now_m,
            contact_point_m=None if sweep is None else _point(sweep),
            contact_fraction=None if sweep is None else sweep.contact_fraction,
            any_path=None,
            **_words(event),
            observations=None if told is None else told.occurrences,
            predicted_displacement=self._by_name(None if told is None else told.mean),
            predicted_endpoint=self._by_name(_leads_to(event)),
            similar_situations=times[1] if times else None,
            similar_contacts=times[0] if times else None,
            stamp=event.stamp_s,
            published_unix_s=self.unix_s(event.now_s),
            uptime_s=None if self.start_s is None else event.now_s - self.start_s,
            input_age_s=event.input_age_s,
            compute_ms=compute_ms,
            raised_unix_s=self.unix_s(event.raised_s),
            changed_unix_s=self.unix_s(event.changed_s),
            acked_by=event.acked_by,
            shelved_by=event.shelved_by,
            shelved_until_unix_s=self._unix_or_none(event.shelved_until_s),
            expires_after_s=self.site.guard.alerts.expires_after_s,
            text=wire.alert_text(
                event.link,
                zone if zone is not None else found.note,
                found.time_to_collision_s,
                event.level.word,
                found.source,
                machine_off=event.inhibit is Inhibit.MACHINE_OFF,
                in_margin=sweep is not None and (sweep.clearance_now_m or 0.0) < 0.0,
                times=times,
            ),
        )

    def prediction(self, event: PredictionEvent) -> wire.Prediction:
        """A prediction event as ``rampe.prediction.v1``."""
        ended = event.event == "ended"
        return wire.Prediction(
            boot_id=self.boot_id,
            seq=event.seq,
            site=self.site.name,
            machine=self.site.machine,
            event=event.event,
            **self._told(event.prediction),
            displacement=self._by_name(event.prediction.progress) if ended else None,
            learned=event.learned if ended else None,
            not_learned=event.refusal,
            endpoints=self._endpoints(event.prediction),
            any_path=None,
            sweeps=tuple(_sweep(s) for s in event.sweeps),
            scenarios=self._scenarios(event.outlook),
            stamp=event.stamp_s,
            published_unix_s=self.unix_s(event.now_s),
        )

    def advice(self, event: AdviceEvent) -> wire.Advice:
        """An advice event as ``rampe.advice.v1``."""
        given, why = event.advice, event.why
        return wire.Advice(
            boot_id=self.boot_id,
            seq=event.seq,
            site=self.site.name,
            machine=self.site.machine,
            quality="none" if given is None else "degraded" if event.degraded else "good",
            actuators=None if given is None else self._levers(given),
            reason=why,
            stamp=event.stamp_s,
            published_unix_s=self.unix_s(event.now_s),
            expires_after_s=self.site.guard.advice.hold_s,
            text=wire.no_advice_text(why or "") if given is None else self._tightest(given),
        )

    def state(
        self,
        heartbeat: wire.Heartbeat,
        snapshot: Snapshot,
        prediction: wire.Prediction | None,
    ) -> wire.State:
        """Everything at once as ``rampe.state.v1``."""
        return wire.State(
            heartbeat=heartbeat,
            alerts=tuple(self.alert(e) for e in snapshot.alerts),
            predictions=() if prediction is None else (prediction,),
            position=self._by_name(snapshot.position),
        )

    def _levers(self, given: Advice) -> dict[str, wire.ActuatorAdvice]:
        return {
            name: wire.ActuatorAdvice(
                negative_share=low,
                positive_share=high,
                negative_zone=zones[0],
                positive_zone=zones[1],
            )
            for name, (low, high), zones in zip(
                self.site.actuator_names, given.shares.tolist(), given.zones, strict=True
            )
        }

    def _tightest(self, given: Advice) -> str:
        i, k = divmod(int(given.shares.argmin()), 2)
        share = float(given.shares[i, k])
        lever = self.site.actuator_names[i] if share < 1.0 else None
        return wire.advice_text(lever, share, given.zones[i][k])

    def _unix_or_none(self, now_s: float | None) -> float | None:
        return None if now_s is None else self.unix_s(now_s)

    def _told(self, told: PredictionSummary) -> dict[str, Any]:
        return {
            "category": told.category,
            "borrowed_from": told.related,
            "observations": told.occurrences,
            "mean": self._by_name(told.mean),
            "scale": self._by_name(told.scale),
            "dof": self._by_name(told.dof),
            "start": self._by_name(told.start),
            "endpoint": self._by_name(told.endpoint),
            "progress": self._by_name(told.progress),
        }

    def _endpoints(self, told: PredictionSummary) -> tuple[wire.Endpoint, ...]:
        if told.endpoints is None or told.endpoint_shares is None:
            return ()
        return tuple(
            wire.Endpoint(position=self._by_name(end) or {}, share=float(share))
            for end, share in zip(told.endpoints, told.endpoint_shares, strict=True)
        )

    def _scenarios(self, outlook: Outlook) -> tuple[wire.Scenario, ...]:
        here = outlook.position
        if here is None:
            return ()
        return tuple(
            wire.Scenario(
                share=min(way.weight / outlook.weight, 1.0),
                count=way.count,
                duration_s=float(way.time_s[-1]),
                endpoint=self._by_name(here + way.end) or {},
            )
            for way in outlook.scenarios
        )

    def _by_name(self, values: FloatArray | None) -> dict[str, float] | None:
        if values is None:
            return None
        return dict(zip(self.site.actuator_names, values.tolist(), strict=True))


def _leads_to(event: AlertEvent) -> FloatArray | None:
    """Where the motion is likely to end (n,) [unit]."""
    if event.evidence.source == "next":
        return event.evidence.onward
    return None if event.prediction is None else event.prediction.endpoint


def _words(event: AlertEvent) -> dict[str, Any]:
    """The fields whose wire types are sets of words."""
    told = event.prediction
    return {
        "level": event.level.word,
        "previous_level": event.previous_level.word,
        "state": "normal" if event.state is State.PENDING else event.state.value,
        "category": None if told is None else told.category,
    }


def _point(sweep: ZoneSweep) -> Point | None:
    """Where it touches first; an arm that is in the object already has no such point."""
    return None if sweep.touching else sweep.contact_point_m


def _sweep(summary: SweepSummary) -> wire.PredictionSweep:
    zone = summary.zone
    return wire.PredictionSweep(
        source=summary.source,
        zone=zone.zone,
        certificate=zone.certificate.value,
        contact_fraction=zone.contact_fraction,
        link=zone.link,
        contact_point_m=_point(zone),
        clearance_m=zone.clearance_m,
        clearance_now_m=zone.clearance_now_m,
        probability=summary.probability,
        time_to_collision_s=summary.time_to_collision_s,
    )
