"""Random motions of two arms in random scenes: the sweep against dense sampling.

Run it as ``python tests/benchmarks/oracle.py --motions 300`` from the project's root.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from rampe_guard.collision import FclSweeper, load_arm  # noqa: E402
from rampe_guard.core.arm import ArmDescription  # noqa: E402
from rampe_guard.core.scene import Scene  # noqa: E402
from rampe_guard.settings import load_site  # noqa: E402
from tests.support.arms import six_axis  # noqa: E402
from tests.support.compare import compare  # noqa: E402
from tests.support.dense import DenseArm  # noqa: E402
from tests.support.scenes import random_motion, random_scene  # noqa: E402

PER_SCENE = 5


def run(description: ArmDescription, reach: float, motions: int, seed: int, folder: Path) -> int:
    """Print figures for one arm; the number of wrong verdicts."""
    rng = np.random.default_rng(seed)
    arm, dense = load_arm(description), DenseArm(description)
    lower = np.where(np.isfinite(arm.limits[:, 0]), arm.limits[:, 0], -3.0)
    upper = np.where(np.isfinite(arm.limits[:, 1]), arm.limits[:, 1], 3.0)
    kinds: Counter[str] = Counter()
    early: list[float] = []
    times: list[float] = []
    bad = 0
    for _ in range(-(-motions // PER_SCENE)):
        items = random_scene(rng, folder, reach)
        sweeper = FclSweeper(arm, Scene(tuple(items)))
        for _ in range(PER_SCENE):
            start, displacement = random_motion(rng, lower, upper, 0.25)
            times.append(sweeper.sweep(start, displacement).elapsed_ms or 0.0)
            for verdict in compare(sweeper, dense, items, start, displacement):
                kinds[verdict.certificate.value] += 1
                early += [] if verdict.early_m is None else [verdict.early_m]
                if verdict.wrong:
                    bad += 1
                    print("WRONG", verdict.zone, verdict.wrong, start.tolist(), displacement)
    print(f"{arm.name}: {len(times)} motions, zones {dict(kinds)}, wrong {bad}")
    if early:
        later = 1e3 * np.percentile(early, [50, 99, 100])
        print(f"  called before the dense contact by [mm] median/p99/max {later.round(2)}")
    print(f"  sweep [ms] median/p99/max {np.percentile(times, [50, 99, 100]).round(2)}")
    return bad


def main() -> int:
    """Both arms."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motions", type=int, default=300, help="in all, half for each arm")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    half = options.motions // 2
    site = load_site(ROOT / "config" / "sites" / "demo.yaml")
    with tempfile.TemporaryDirectory() as folder:
        bad = run(six_axis(Path(folder)), 1.0, half, options.seed, Path(folder))
        bad += run(site.arm, 8.0, half, options.seed, Path(folder))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
