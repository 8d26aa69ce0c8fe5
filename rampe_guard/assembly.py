"""From a site to a loaded machine: the one place where settings, geometry and core meet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rampe_guard.collision import Arm, FclSweeper, load_arm
from rampe_guard.core.guard import Guard
from rampe_guard.core.types import PathSweeper, SweepResult
from rampe_guard.settings import Site


@dataclass(frozen=True, slots=True)
class Machine:
    """A site with its geometry loaded: arm, keep-out scene and sweeper."""

    site: Site
    arm: Arm
    sweeper: FclSweeper

    def guard(
        self,
        start_s: float,
        boot_id: str,
        sweeper: PathSweeper | None = None,
        *,
        advise: bool = False,
    ) -> Guard:
        """A guard that starts at ``start_s`` on the clock of its steps.

        Args:
            start_s: time at which monitoring begins [s].
            boot_id: makes alert ids unique across restarts.
            sweeper: instead of the machine's own (to time it, say).
            advise: give speed advice if the site wants it: a replay has nobody to follow it.
        """
        config = self.site.guard
        advice = replace(config.advice, enabled=advise and config.advice.enabled)
        return Guard(
            replace(config, advice=advice),
            self.arm.limits,
            sweeper or self.sweeper,
            start_s,
            boot_id,
            self.site.scene.moving,
        )


def load_machine(site: Site, progress: Callable[[str, float], None] | None = None) -> Machine:
    """Load meshes and scene of a site.

    Args:
        site: as `load_site` returns it.
        progress: told what is done, and which share of it from 0 to 1.

    Raises:
        GeometryError: a URDF, mesh, linkage or scene object cannot be used.
    """
    arm = load_arm(site.arm)
    sweeper = FclSweeper(arm, site.scene, site.sweep, site.self_collision, progress=progress)
    return Machine(site, arm, sweeper)


class Sweeper:
    """Certified sweeps for a site; see `core.types.SweepResult` for the answer.

    Args:
        site: as `load_site` returns it.
    """

    def __init__(self, site: Site) -> None:
        self._sweeper = load_machine(site).sweeper

    def sweep(
        self,
        start: npt.ArrayLike,
        displacement: npt.ArrayLike,
        *,
        any_path: bool = True,
        clearance: bool = True,
        worst: bool = False,
    ) -> SweepResult:
        """Sweep every link along a straight actuator path.

        Args:
            start: (n,) actuator positions [unit].
            displacement: (n,) [unit].
            any_path: also answer for every monotone path.
            clearance: also find the least clearance; certificates are sooner done without.
            worst: only the worst zone is wanted, which is sooner done than all of them.

        Raises:
            ValueError: wrong length, or a value that is not finite.
        """
        start = np.asarray(start, dtype=np.float64)
        displacement = np.asarray(displacement, dtype=np.float64)
        return self._sweeper.sweep(
            start, displacement, any_path=any_path, clearance=clearance, worst=worst
        )


def guard_for(site: Site, start_s: float = 0.0) -> Guard:
    """A replayable guard for a site; feed it with `Guard.step`."""
    return load_machine(site).guard(start_s, "offline")
