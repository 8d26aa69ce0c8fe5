"""Speed advice: how much of each lever leaves the arm able to stop short of every zone.

::

    coast (all let go) ─► what is met whatever is done: nothing that goes nearer is advised
    each direction alone, the others coasting ─► room ─► share (`shaping`)
    the levers as they are out, together ─► smaller shares for those that close in

Every share that is given was swept: each direction alone, and all levers that are out together,
leg by leg as the actuators come to rest. Of levers that are at rest a few are looked at each time.
A zone that cannot be computed, or an object of which nobody knows where it is, counts as met.
Shares fall at once and rise slowly.

It is advice. Nothing here moves a machine, nor is it a safety function.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rampe_guard.core.config import ActuatorConfig, AdviceConfig
from rampe_guard.core.forecast import within_travel
from rampe_guard.core.shaping import Pending, ShapingLaw, legs
from rampe_guard.core.types import Certificate, FloatArray, PathSweeper, Placement, ZoneSweep

_SIGNS = (-1.0, 1.0)
_TRIES = 3
"""How often shares are lowered and swept again before those that close in get nothing."""
_SPARE = 0.98
"""Share of a proven way that is used: the next state is measured, with noise."""
_STILL = 1e-9
_TURNS = 4
"""Directions in which no lever is out are looked at in so many turns."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What each actuator may be commanded, as a share of its top speed.

    Attributes:
        shares: (n, 2) in [0, 1]: towards smaller and towards larger values.
        zones: (n, 2) names of the zones that limit them, None where nothing does.
    """

    shares: FloatArray
    zones: tuple[tuple[str | None, str | None], ...]


@dataclass(frozen=True, slots=True)
class Instant:
    """What advice is given for.

    Attributes:
        q: position (n,) [unit].
        velocity: (n,) [unit/s].
        command: levers as they are (n,), in [-1, 1] along the actuators.
        placed: where the zones that move are.
        restless: whether a zone may come nearer whatever the arm does.
        now_s: for the pace at which shares rise [s].
    """

    q: FloatArray
    velocity: FloatArray
    command: FloatArray
    placed: Mapping[str, Placement | None]
    restless: Callable[[str], bool]
    now_s: float

    def met(self, zone: ZoneSweep) -> bool:
        """It is touched, and not by an arm that is in it and leaves."""
        return zone.certificate is not Certificate.FREE and (not zone.inside or self.neared(zone))

    def neared(self, zone: ZoneSweep) -> bool:
        """It is nearer soon."""
        return zone.closing or self.restless(zone.zone)


@dataclass(frozen=True, slots=True)
class _Contact:
    """The first zone that a way meets, and where on it (n,) [unit from the start]."""

    zone: str
    at: FloatArray


@dataclass(slots=True)
class _Limit:
    """Of one direction of one actuator: share, what limits it, and what it closes in on."""

    share: float = 1.0
    zone: str | None = None
    nears: frozenset[str] = frozenset()

    def lower(self, share: float, zone: str | None) -> None:
        if share < self.share:
            self.share, self.zone = share, zone


class Adviser:
    """Gives advice; remembers what it advised last.

    Args:
        actuators: in site order.
        limits: (n, 2) [unit]; no way leads past them.
        config: settings.
        sweeper: geometry.
    """

    def __init__(
        self,
        actuators: tuple[ActuatorConfig, ...],
        limits: FloatArray,
        config: AdviceConfig,
        sweeper: PathSweeper,
    ) -> None:
        self._law = ShapingLaw(actuators, config.hold_s)
        self._pending = Pending(actuators, config.period_s)
        self._deadband = np.array([a.deadband for a in actuators])
        self._limits, self._config, self._sweeper = limits, config, sweeper
        self._last: tuple[float, Advice] | None = None
        self._known: dict[tuple[int, float], _Limit] = {}
        self._turn = 0
        self._away: dict[str, set[tuple[int, float]]] = {}

    def change_scene(self, sweeper: PathSweeper) -> None:
        """Sweep by another geometry from now on."""
        self._sweeper = sweeper
        self._known.clear()
        self._away.clear()

    def forget(self) -> None:
        """What was advised last says nothing of what may be advised next."""
        self._last = None
        self._known.clear()
        self._pending.forget()

    def advise(self, moment: Instant) -> Advice:
        """What may be commanded now."""
        speeds = self._pending.speeds(moment.now_s)
        one = _One(self._law, self._limits, self._sweeper, moment, speeds, self._away)
        out = [int(i) for i in np.flatnonzero(np.abs(moment.command) > self._deadband)]
        limits = self._each(one, out)
        if len(out) > 1:
            one.together({i: limits[i][int(moment.command[i] > 0.0)] for i in out})
        shares = np.array([[limit.share for limit in pair] for pair in limits])
        zones = tuple((low.zone, high.zone) for low, high in limits)
        self._last = moment.now_s, self._calmed(Advice(shares, zones), moment.now_s)
        most = self._last[1].shares
        self._pending.give(np.clip(moment.command, -most[:, 0], most[:, 1]), moment.now_s)
        return self._last[1]

    def _each(self, one: _One, out: list[int]) -> list[tuple[_Limit, _Limit]]:
        """Every direction alone; those of levers at rest in turns."""
        self._turn += 1
        found = []
        for i in range(len(self._limits)):
            pair = []
            for k, sign in enumerate(_SIGNS):
                pushed = i in out and (one.moment.command[i] > 0.0) == (sign > 0.0)
                due = (2 * i + k + self._turn) % _TURNS == 0
                if pushed or due or (i, sign) not in self._known:
                    self._known[i, sign] = one.alone(i, sign)
                known = self._known[i, sign]
                pair.append(_Limit(known.share, known.zone, known.nears))
            found.append((pair[0], pair[1]))
        return found

    def _calmed(self, found: Advice, now_s: float) -> Advice:
        """Shares that rise no faster than they may; what held them until now is still named."""
        if self._last is None:
            return found
        at_s, before = self._last
        most = before.shares + self._config.rise_per_s * max(now_s - at_s, 0.0)
        zones = [
            tuple(
                old if zone is None and most[i, k] < 1.0 else zone
                for k, (zone, old) in enumerate(zip(now, then, strict=True))
            )
            for i, (now, then) in enumerate(zip(found.zones, before.zones, strict=True))
        ]
        return Advice(np.minimum(found.shares, most), tuple((z[0], z[1]) for z in zones))


class _One:
    """The sweeps of one moment."""

    def __init__(
        self,
        law: ShapingLaw,
        limits: FloatArray,
        sweeper: PathSweeper,
        moment: Instant,
        pending: FloatArray,
        away: dict[str, set[tuple[int, float]]],
    ) -> None:
        self._law, self._limits, self._sweeper, self.moment = law, limits, sweeper, moment
        self._away = away
        self._done: dict[tuple[bytes, bytes], tuple[ZoneSweep, ...]] = {}
        v = moment.velocity
        # how fast each goes soon, towards smaller and larger values, with what is under way
        self._along = np.maximum(np.stack((-v, v), axis=1), pending)
        ahead = np.where(v < 0.0, -self._along[:, 0], self._along[:, 1])
        still = np.abs(v) < pending.max(axis=1)
        way, self._rests_s = law.coast(
            np.where(still & (pending[:, 0] > pending[:, 1]), -pending[:, 0], ahead)
        )
        self._coast = within_travel(limits, moment.q, way)
        met: set[str] = set()
        for leg, start in self._legs(self._coast, self._rests_s):
            met |= {z.zone for z in self._swept(start, leg) if moment.met(z)}
        self._doomed = frozenset(met)

    def alone(self, i: int, sign: float) -> _Limit:
        """One direction of one actuator, while the others coast."""
        limit, along = _Limit(), float(self._along[i, int(sign > 0.0)])
        full = self._reach(i, sign, along, 1.0)
        if full <= _STILL:  # at its stop
            return limit
        pure = np.zeros(len(self._coast))
        pure[i] = sign * full
        beside = self._swept(self.moment.q, pure)
        limit.nears = frozenset(z.zone for z in beside if self._neared(z, i, sign))
        self._leave(i, along, full, beside, limit)
        for _ in range(_TRIES):
            contact = self._first({i: sign}, {i: limit})
            if contact is None:
                return limit
            room = _SPARE * abs(float(contact.at[i]))
            limit.lower(self._law.share(i, along, room), contact.zone)
            if limit.share == 0.0:
                return limit
        limit.lower(0.0, limit.zone)
        return limit

    def _neared(self, zone: ZoneSweep, i: int, sign: float) -> bool:
        """One direction leads nearer to a zone.

        Within the object itself no distance tells; what led away before it was touched still does.
        """
        away = self._away.setdefault(zone.zone, set())
        if zone.touching and not self.moment.restless(zone.zone):
            return (i, sign) not in away
        nearer = self.moment.neared(zone)
        (away.discard if nearer else away.add)((i, sign))
        return nearer

    def _leave(
        self, i: int, along: float, full: float, beside: tuple[ZoneSweep, ...], limit: _Limit
    ) -> None:
        """Zones that are met whatever is done: only what leads away from them is left free."""
        for zone in beside:
            if zone.zone not in self._doomed:
                continue
            if zone.zone in limit.nears or zone.certificate is Certificate.UNKNOWN:
                limit.lower(0.0, zone.zone)
            elif self.moment.met(zone) and not zone.touching:
                room = _SPARE * (zone.contact_fraction or 0.0) * full
                limit.lower(self._law.share(i, along, room), zone.zone)

    def together(self, levers: dict[int, _Limit]) -> None:
        """Lower the shares of the levers that are out until their common way is free."""
        signs = {i: float(np.sign(self.moment.command[i])) for i in levers}
        for attempt in range(_TRIES + 2):
            contact = self._first(signs, levers)
            if contact is None:
                return
            guilty = [i for i, limit in levers.items() if contact.zone in limit.nears]
            if not guilty or attempt > _TRIES:
                guilty = [*levers]
            for i in guilty:
                along = float(self._along[i, int(signs[i] > 0.0)])
                room = _SPARE * abs(float(contact.at[i]))
                share = 0.0 if attempt >= _TRIES else self._law.share(i, along, room)
                levers[i].lower(share, contact.zone)

    def _first(self, signs: Mapping[int, float], levers: Mapping[int, _Limit]) -> _Contact | None:
        """The first zone met if these levers are out by so much, and the others coast."""
        way, lasts_s = self._coast.copy(), self._rests_s.copy()
        for i, limit in levers.items():
            along = float(self._along[i, int(signs[i] > 0.0)])
            way[i] = signs[i] * self._reach(i, signs[i], along, limit.share)
            lasts_s[i] = self._law.lasts_s(i, along, limit.share)
        for leg, start in self._legs(way, lasts_s):
            found = [
                z
                for z in self._swept(start, leg)
                if z.zone not in self._doomed and self.moment.met(z)
            ]
            if found:
                first = min(found, key=lambda z: z.contact_fraction or 0.0)
                at = start - self.moment.q + (first.contact_fraction or 0.0) * leg
                return _Contact(first.zone, at)
        return None

    def _legs(self, way: FloatArray, lasts_s: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Legs of a way, and where each begins; one that leads nowhere has one too."""
        start, found = self.moment.q, []
        for leg in legs(way, lasts_s):
            found.append((leg, start))
            start = start + leg
        return found or [(way, start)]

    def _reach(self, i: int, sign: float, along: float, share: float) -> float:
        """How far an actuator goes, within its travel [unit]."""
        end = float(self._limits[i, int(sign > 0.0)])
        room = max(sign * (end - float(self.moment.q[i])), 0.0)
        return min(self._law.reach(i, along, share), room)

    def _swept(self, start: FloatArray, way: FloatArray) -> tuple[ZoneSweep, ...]:
        """Every way once: while nothing else coasts, a lever alone is asked about twice."""
        asked = start.tobytes(), way.tobytes()
        if asked not in self._done:
            placed = self.moment.placed
            result = self._sweeper.sweep(start, way, clearance=False, placed=placed)
            self._done[asked] = result.zones
        return self._done[asked]
