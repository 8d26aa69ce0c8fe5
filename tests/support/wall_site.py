"""A site of the bench excavator whose zones are walls where its recorded work seldom goes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rampe_guard.collision import load_arm
from rampe_guard.runtime.csv_log import read_csv_log
from rampe_guard.settings import load_site
from tests.support.processes import BENCH, ROOT

OUTER = (0.1, 0.9)
"""Quantiles of all positions of all logs at which the walls stand."""


def write_wall_site(folder: Path, logs: Sequence[str | Path]) -> Path:
    """Write site and scene into ``folder``: two actuator limits for each actuator.

    Args:
        folder: that is there.
        logs: CSV files of the bench excavator; the walls come from all of them together.
    """
    site = load_site(BENCH)
    limits = load_arm(site.arm).limits
    positions = np.concatenate([read_csv_log(site, log, limits).position for log in logs])
    low, high = np.quantile(positions, OUTER, axis=0)
    lines = ["frame: world", "objects:"]
    for name, below, above in zip(site.actuator_names, low.tolist(), high.tolist(), strict=True):
        wall = f"type: actuator_limit, actuator: {name}"
        lines.append(f"  - {{name: {name}-low, {wall}, below: {below:.6f}}}")
        lines.append(f"  - {{name: {name}-high, {wall}, above: {above:.6f}}}")
    (folder / "walls.yaml").write_text("\n".join(lines) + "\n", "utf-8")
    return write_site(folder, "walls")


def write_site(folder: Path, scene: str) -> Path:
    """The bench excavator's site with the scene of that name, which is in ``folder``."""
    text = BENCH.read_text("utf-8")
    for old, new in (
        ("../../geometry", str(ROOT / "geometry")),
        ("../scenes/bench.yaml", f"{scene}.yaml"),
    ):
        assert old in text, old
        text = text.replace(old, new)
    path = folder / f"{scene}-site.yaml"
    path.write_text(text, "utf-8")
    return path
