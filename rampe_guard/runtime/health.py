"""Health of the running daemon: rates, times and reasons, as the heartbeat tells them."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from rampe_guard import __version__, wire
from rampe_guard.core.monitor import Health, ObjectHealth, Status
from rampe_guard.core.types import FloatArray, PathSweeper, Placement, SweepResult
from rampe_guard.runtime.pace import Pace
from rampe_guard.runtime.resources import resources
from rampe_guard.settings import Site

_TIMES = 1000
"""Durations kept for the quantiles: ten seconds at 100 Hz."""
_RATE_WINDOW_S = 2.0


BUCKETS_MS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""Upper ends of the buckets in which durations are counted for good; one more has no end."""


class Durations:
    """The newest durations [ms] of something and their quantiles; all of them, counted.

    Attributes:
        counts: how many fell in each of `BUCKETS_MS`, and beyond the last.
        total_ms: sum of all.
    """

    def __init__(self) -> None:
        self._values: deque[float] = deque(maxlen=_TIMES)
        self.counts = [0] * (len(BUCKETS_MS) + 1)
        self.total_ms = 0.0

    def add(self, milliseconds: float) -> None:
        """Note one."""
        self._values.append(milliseconds)
        self.counts[bisect_left(BUCKETS_MS, milliseconds)] += 1
        self.total_ms += milliseconds

    def quantiles(self) -> wire.Quantiles | None:
        """Median and 99th percentile [ms]; None before the first."""
        if not self._values:
            return None
        p50, p99 = np.percentile(self._values, [50, 99])
        return wire.Quantiles(p50=float(p50), p99=float(p99))


class TimedSweeper:
    """A sweeper whose times are noted."""

    def __init__(self, inner: PathSweeper, spent: Durations) -> None:
        self._inner = inner
        self._spent = spent

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
        """See `PathSweeper.sweep`."""
        result = self._inner.sweep(
            start,
            displacement,
            any_path=any_path,
            clearance=clearance,
            wider_m=wider_m,
            only=only,
            placed=placed,
        )
        if result.elapsed_ms is not None:
            self._spent.add(result.elapsed_ms)
        return result


class Rates:
    """Messages per second, from counts at past heartbeats."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, dict[str, int]]] = deque()

    def update(self, now_s: float, accepted: Mapping[str, int]) -> Callable[[str], float | None]:
        """Rates [1/s] over the last two seconds, by name; None at the first heartbeat."""
        self._past.append((now_s, dict(accepted)))
        while self._past[0][0] < now_s - _RATE_WINDOW_S and len(self._past) > 1:
            self._past.popleft()
        then_s, then = self._past[0]

        def rate(name: str) -> float | None:
            if now_s <= then_s:
                return None
            return (accepted.get(name, 0) - then.get(name, 0)) / (now_s - then_s)

        return rate


@dataclass(frozen=True, slots=True)
class Own:
    """What the daemon knows of itself; see the fields of the heartbeat of the same names."""

    alerts: Mapping[str, int] | None = None
    learned: wire.Learned | None = None
    save_failures: int | None = None
    router: bool | None = None
    commands: wire.Commands | None = None


_NOTHING = Own()


@dataclass
class Pulse:
    """Makes heartbeats.

    Attributes:
        site: whose guard it is.
        boot_id: of this run.
        start_s: when the guard started, on the core's clock.
    """

    site: Site
    boot_id: str
    start_s: float
    unix_s: Callable[[float], float]
    scene_hash: str

    def __post_init__(self) -> None:
        self.loop_ms = Durations()
        self.sweep_ms = Durations()
        self.tick = 0
        self._pace = Pace()
        self._rates = Rates()
        self._object_rates = Rates()
        self._seq = 0

    def turn(self, now_s: float) -> None:
        """The worker loop begins another turn."""
        self.tick += 1
        self._pace.turn(now_s)

    def step(self, now_s: float, took_ms: float) -> None:
        """A step with a new position that began at ``now_s`` [s] took so long [ms]."""
        self.loop_ms.add(took_ms)
        self._pace.step(now_s, took_ms)

    def beat(
        self,
        health: Health,
        now_s: float,
        overruns: int,
        primitives: dict[str, int],
        extra: Iterable[wire.Reason] = (),
        canary: wire.CanaryTrial | None = None,
        memory: wire.Remembered | None = None,
        knows: Own = _NOTHING,
    ) -> wire.Heartbeat:
        """A heartbeat; ``extra`` are reasons that only the daemon knows (no router, say)."""
        self._seq += 1
        own = self.site.keys
        keys = {"joystick": own.joystick, "actuators": own.actuators, "enabled": own.enabled}
        reasons = [
            wire.Reason(code=r.code, text=r.text, key=keys[r.input] if r.input else r.key)
            for r in health.reasons
        ]
        more = (
            [] if health.off else [*extra, *self._pace.reasons(now_s)]
        )  # what is off has no other weakness
        status = Status.DEGRADED if more and health.status is Status.OK else health.status
        rejected: dict[str, dict[str, int]] = {}
        for (name, reason), count in health.rejected.items():
            rejected.setdefault(name, {})[reason] = count
        accepted = {str(name): count for name, count in health.accepted.items()}
        rate = self._rates.update(now_s, accepted)
        return wire.Heartbeat(
            boot_id=self.boot_id,
            seq=self._seq,
            site=self.site.name,
            machine=self.site.machine,
            status=status.value,
            reasons=(*reasons, *more),
            input_age_s=wire.InputAges(
                joystick_s=health.ages_s["joystick"], actuators_s=health.ages_s["actuators"]
            ),
            rates_hz=wire.InputRates(joystick=rate("joystick"), actuators=rate("actuators")),
            accepted=accepted,
            rejected=rejected,
            objects=self._objects(health.objects, now_s),
            canary=canary,
            primitives=primitives,
            memory=memory,
            drops=overruns,
            alerts=None if knows.alerts is None else dict(knows.alerts),
            learned=knows.learned,
            save_failures=knows.save_failures,
            router=knows.router,
            commands=knows.commands,
            resources=resources(),
            steps=sum(self.loop_ms.counts),
            loop_ms=self.loop_ms.quantiles(),
            sweep_ms=self.sweep_ms.quantiles(),
            tick=self.tick,
            scene_hash=self.scene_hash,
            config_hash=self.site.content_hash,
            version=__version__,
            published_unix_s=self.unix_s(now_s),
            uptime_s=now_s - self.start_s,
        )

    def _objects(
        self, objects: Iterable[ObjectHealth], now_s: float
    ) -> tuple[wire.ObjectInput, ...]:
        objects = tuple(objects)
        rate = self._object_rates.update(now_s, {o.name: o.accepted for o in objects})
        return tuple(
            wire.ObjectInput(
                name=o.name,
                key=o.key,
                placed=o.grown_m is not None,
                age_s=o.age_s,
                grown_m=o.grown_m,
                rate_hz=rate(o.name),
                accepted=o.accepted,
                rejected=o.rejected,
            )
            for o in objects
        )
