"""A log of the bench excavator as its site file maps it, of an operator who aims at places."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rampe_guard.settings import LogMapping, load_site
from tests.support.processes import BENCH

PERIOD_S = 0.1
REST_S = 0.6


def bench_mapping() -> LogMapping:
    mapping = load_site(BENCH).log
    assert mapping is not None
    return mapping


def write_log(path: Path, cycles: int, seed: int) -> Path:
    """An operator who swings to and fro and lifts and lowers, never twice quite alike.

    He aims at places, so that how far he goes follows from where he starts.
    """
    rng = np.random.default_rng(seed)
    mapping = bench_mapping()
    names = ("swing", "boom", "stick", "bucket")
    speed = np.array([0.6, 0.02, 0.03, 0.03])
    q = np.array([0.0, 0.05, 0.07, 0.05])
    goals = [(0, 0.8, 0.15), (1, 0.08, 0.004), (0, -0.8, 0.15), (1, 0.04, 0.004)]
    columns = [mapping.joystick[n] for n in names] + [mapping.actuators[n] for n in names]
    lines = [",".join([mapping.time.column, *(c.column for c in columns)])]
    t = 0.0
    for j, goal, spread in goals * cycles:
        aim = rng.normal(goal, spread)
        lever = np.zeros(4)
        lever[j] = np.sign(aim - q[j])
        moving = round(abs(aim - q[j]) / (speed[j] * PERIOD_S))
        for u in [lever] * moving + [np.zeros(4)] * round(REST_S / PERIOD_S):
            q = q + u * speed * PERIOD_S
            values = zip([*u, *q], columns, strict=True)
            raw = [(value - c.offset) / c.scale for value, c in values]
            lines.append(",".join(f"{v:.9g}" for v in (t, *raw)))
            t += PERIOD_S
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
