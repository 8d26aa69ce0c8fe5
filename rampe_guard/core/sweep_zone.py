"""Certified search of one path against one zone, on the bounds of `sweep_rows`.

A cell is free when every row's bound exceeds margin + tolerance. What stays in doubt, because
pieces bulge beyond the surfaces they hold or because the arm is really there, is walked through
by conservative advancement with exact distances, earliest cell first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rampe_guard.core.sweep_rows import BudgetSpentError, Rows, ratio
from rampe_guard.core.types import Certificate, ZoneSweep

if TYPE_CHECKING:
    from rampe_guard.core.config import SweepConfig
    from rampe_guard.core.sweep_problem import Zone
    from rampe_guard.core.types import Point

SPLITS = 8
"""Rows that may be cut in a row before exact distances are asked instead."""
NOISE_M = 1e-6
"""Smaller changes of a distance than this are no motion [m]."""


@dataclass(frozen=True, slots=True)
class _Touch:
    """Earliest contact so far."""

    fraction: float
    link: int
    point: Point


class ZoneSearch:
    """One zone's search; `run` is the way through it."""

    def __init__(
        self, zone: Zone, rows: Rows, config: SweepConfig, link_names: tuple[str, ...]
    ) -> None:
        self._zone, self._rows, self._path = zone, rows, rows.path
        self._names = link_names
        self._near = zone.margin_m + config.tolerance_m
        # What stays proven while stepping: a little more than the margin, so that steps end.
        self._target = zone.margin_m + 0.5 * config.tolerance_m
        self._slack, self._fine = config.clearance_tolerance_m, config.tolerance_m
        self._least = np.inf
        """Least distance seen at any sample, about [m]: it says when a bound is sharp."""
        self._link_now = int(rows.link[np.argmin(rows.start)])
        self._touch: _Touch | None = None

    def run(self, *, clearance: bool) -> ZoneSweep:
        """Certify the zone; with ``clearance`` also say how near the path comes to it.

        Without it, the clearances are what certifying happened to prove, and at the start it
        is only settled whether the arm is inside, and if so whether it moves further in.
        """
        closing = bool(self._path.displacement.any())  # until the contrary is shown
        done = now_known = False
        try:
            inside = self._rows.contained()
            if inside is not None:
                self._touch = _Touch(0.0, *inside)
                self._rows.start[:] = np.minimum(self._rows.start, 0.0)
                return self._result(done=True, now_known=True, closing=closing)
            self._clearance_now(sharp=clearance)
            now_known = True
            self._certify()
            done = True
            closing = closing and self._closing(sharp=clearance)
            if clearance and self._touch is None:
                self._clearance_on_the_way()
        except BudgetSpentError:
            pass
        return self._result(done=done, now_known=now_known, closing=closing)

    # --- the start -------------------------------------------------------------------------

    def _clearance_now(self, *, sharp: bool) -> None:
        """Raise the bounds at the start until the least is within the tolerance of the truth.

        Near the margin that is the tolerance of a contact: whether the arm is inside decides.
        Not ``sharp``, that decision is all that is wanted.
        """
        rows = self._rows
        while True:
            row = int(np.argmin(rows.start))
            link = self._link_now = int(rows.link[row])
            slack = self._slack if self._least > self._near + self._slack else self._fine
            if rows.start[row] >= self._least - slack:
                return
            if not sharp and rows.start[row] > self._near:
                return
            if not rows.tried[row, 0]:
                gap = rows.query(row, 0)
                if gap > self._near:
                    self._least = min(self._least, gap + rows.excess(row))
            elif not rows.knows_start(link):
                self._exact_start(link)
            elif not rows.replace(row):
                return

    def _exact_start(self, link: int) -> None:
        distance = self._rows.distance(link, 0.0).distance_m
        self._least = min(self._least, distance)
        self._raise_start(link, distance)

    def _raise_start(self, link: int, distance: float) -> None:
        mine = self._rows.link == link
        self._rows.start[mine] = np.maximum(self._rows.start[mine], distance)

    def _closing(self, *, sharp: bool) -> bool:
        """Does a link inside the margin, or else the nearest one, come nearer at the start?

        Outside and not ``sharp``, any motion counts as closing in.
        """
        rows = self._rows
        for row in np.flatnonzero(rows.start <= self._near):
            if not rows.tried[row, 0]:
                rows.query(int(row), 0)
        inside = np.flatnonzero(rows.start <= self._near)
        if not inside.size and not sharp:
            return True
        if not inside.size:
            return self._approaches(self._link_now, exact=False)
        links = sorted({int(link) for link in rows.link[inside]})
        return any(self._approaches(link, exact=True) for link in links)

    def _approaches(self, link: int, *, exact: bool) -> bool:
        rows = self._rows
        if not exact and not rows.knows_start(link):
            mine = np.flatnonzero(rows.link == link)
            nearest = int(mine[np.argmin(rows.start[mine])])
            if not rows.tried[nearest, 0]:
                rows.query(nearest, 0)
            before, after = (float(gap) for gap in rows.probe[nearest])
            if before > 0.0:
                return after < before - NOISE_M
        before = rows.distance(link, 0.0).distance_m
        after = rows.distance(link, self._path.probe).distance_m
        if before == after == 0.0:
            return True  # it moves, and nothing shows that it moves out
        return after < before - NOISE_M

    # --- the way ---------------------------------------------------------------------------

    def _certify(self) -> None:
        """Clear every doubtful cell, the earliest first, or find the first contact."""
        rows, s = self._rows, self._path.fractions
        splits = 0
        for cell in np.flatnonzero((rows.doubt <= self._near).any(axis=0)).tolist():
            while s[cell] < self._touches_at:
                row = int(np.argmin(rows.doubt[:, cell]))
                if rows.doubt[row, cell] > self._near:
                    break
                if not rows.tried[row, cell]:
                    rows.query(row, cell)
                elif not rows.tried[row, cell + 1]:
                    rows.query(row, cell + 1)
                elif splits < SPLITS and rows.replace(row):
                    splits += 1
                else:
                    self._walk(int(rows.link[row]), cell)

    def _walk(self, link: int, cell: int) -> None:
        """Conservative advancement of one link through one cell, up to its first contact.

        Exact distances begin and end it; in between, rows cut ever smaller give longer steps,
        for a separating direction proves more than a distance does.
        """
        rows, rate = self._rows, float(self._path.rate[link, cell])
        s, end = self._ends(cell)
        whole = self._touches_at >= end
        end = min(end, self._touches_at)
        doubtful = np.flatnonzero(
            (rows.link == link) & (rows.doubt[:, cell] <= self._near)
        ).tolist()
        walked = set(doubtful)
        shortest = ratio(self._near - self._target, rate)
        proven = self._exact_step(link, s, rate)
        while doubtful and s < end and self._touches_at != s:
            rest = end - s
            if proven >= rest:
                break
            steps = self._steps(doubtful, cell, s, rest, max(proven, shortest))
            walked |= steps.keys()
            doubtful = [row for row, own in steps.items() if own < rest]
            step = max(proven, min(steps.values()))
            if step < shortest:
                step = self._exact_step(link, s, rate)
            s, proven = s + step, 0.0
        cleared = list(walked)
        rows.doubt[cleared, cell] = np.inf
        if whole and self._touches_at >= end:
            rows.bound[cleared, cell] = np.maximum(rows.bound[cleared, cell], self._zone.margin_m)

    @property
    def _touches_at(self) -> float:
        """Fraction of the earliest contact so far, infinite without one."""
        return np.inf if self._touch is None else self._touch.fraction

    def _exact_step(self, link: int, s: float, rate: float) -> float:
        """How far beyond s the exact distance there proves the link clear; 0 in contact."""
        nearest = self._rows.distance(link, s)
        if nearest.distance_m <= self._near:
            self._touch = _Touch(s, link, nearest.point_m)
            return 0.0
        return ratio(nearest.distance_m - self._target, rate)

    def _steps(
        self, doubtful: list[int], cell: int, s: float, rest: float, least: float
    ) -> dict[int, float]:
        """Step of each row, rows that cannot make ``least`` cut into smaller ones."""
        steps: dict[int, float] = {}
        todo = list(doubtful)
        splits = 0
        while todo:
            row = todo.pop()
            steps[row] = self._rows.step(row, cell, s, rest, self._target)
            if steps[row] <= least and steps[row] < rest and splits < SPLITS:
                halves = self._rows.replace(row)
                if halves:
                    splits += 1
                    del steps[row]
                    todo += halves
        return steps

    def _clearance_on_the_way(self) -> None:
        """Raise the bounds until the least over the path is within the tolerance of the truth."""
        rows = self._rows
        while True:
            worst = np.unravel_index(np.argmin(rows.bound), rows.bound.shape)
            row, cell = int(worst[0]), int(worst[1])
            if rows.bound[row, cell] >= self._least - self._slack:
                return
            sample = cell if not rows.tried[row, cell] else cell + 1
            if not rows.tried[row, sample]:
                gap = rows.query(row, sample)
                if gap > 0.0:
                    self._least = min(self._least, gap + rows.excess(row))
            elif not rows.replace(row):
                self._sharpen(int(rows.link[row]), cell)

    def _sharpen(self, link: int, cell: int) -> None:
        """Prove that a link stays farther than the least distance seen less the tolerance.

        Meeting less on its way it lowers that least, so every step is worth the tolerance.
        """
        rows = self._rows
        s, end = self._ends(cell)
        mine = rows.link == link
        level = np.inf
        while s < end:
            distance = rows.distance(link, s).distance_m
            self._least = min(self._least, distance)
            level = self._least - self._slack
            if level <= self._zone.margin_m:
                return  # that much is proven already
            s += ratio(distance - level, float(self._path.rate[link, cell]))
        rows.bound[mine, cell] = np.maximum(rows.bound[mine, cell], level)

    def _ends(self, cell: int) -> tuple[float, float]:
        return float(self._path.fractions[cell]), float(self._path.fractions[cell + 1])

    # --- the answer ------------------------------------------------------------------------

    def _result(self, *, done: bool, now_known: bool, closing: bool) -> ZoneSweep:
        rows, margin = self._rows, self._zone.margin_m
        least = float(rows.bound.min())
        now = max(float(rows.start.min()), least) - margin if now_known else None
        if self._touch is not None and self._touch.fraction == 0.0 and now is not None:
            now = float(rows.start.min()) - margin  # bounds of the way say nothing of an inside
        proven = done and self._path.end >= 1.0
        worst_row = int(np.unravel_index(np.argmin(rows.bound), rows.bound.shape)[0])
        if self._touch is not None:
            first = self._touch.fraction if done else min(self._touch.fraction, self._doubtful())
            return ZoneSweep(
                zone=self._zone.name,
                certificate=Certificate.CONTACT,
                contact_fraction=first,
                link=self._names[self._touch.link],
                contact_point_m=self._touch.point,
                clearance_m=0.0,
                clearance_now_m=now,
                closing=closing,
                margin_m=margin,
            )
        return ZoneSweep(
            zone=self._zone.name,
            certificate=Certificate.FREE if proven else Certificate.UNKNOWN,
            contact_fraction=None if proven else self._doubtful(),
            link=self._names[int(rows.link[worst_row])],
            contact_point_m=None,
            clearance_m=max(least - margin, 0.0) if proven else None,
            clearance_now_m=now,
            closing=closing,
            margin_m=margin,
        )

    def _doubtful(self) -> float:
        """First fraction that is not certified."""
        doubt = np.flatnonzero((self._rows.doubt <= self._near).any(axis=0))
        return float(self._path.fractions[doubt[0]]) if doubt.size else self._path.end
