"""What the motion in a log says against the site file: columns that are swapped, levers that rest.

Values alone cannot tell two joints from one another, but which lever moves which can.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np

from rampe_guard.core.identify import Traces
from rampe_guard.errors import LogError
from rampe_guard.programs.checkup_live import Findings, against_motion
from rampe_guard.recording import Log
from rampe_guard.settings import Site

_FAR_S = 0.5
"""An actuator that goes further than in so long at top speed has not only crept [s]."""


def motion_warnings(site: Site, log: Log) -> tuple[str, ...]:
    """All of it, a sentence each; nothing where there is too little motion to tell."""
    found = Findings()
    with contextlib.suppress(LogError):  # no lever at all, which was said when it was opened
        traces = Traces(log.time_s, log.axes, log.time_s, log.position)
        against_motion(site, traces, found)
        found.wrong += _unmoved(site, traces)
    return tuple(f"{log.path}: {text}" for text in found.wrong)


def _unmoved(site: Site, traces: Traces) -> Iterator[str]:
    """Actuators that go far while their levers rest."""
    names = []
    for j, actuator in enumerate(site.guard.actuators):
        lever = np.abs(traces.axes[:, actuator.axis])
        far = float(np.ptp(traces.position[:, j])) > _FAR_S * actuator.max_velocity
        if far and lever.max() <= actuator.deadband:
            names.append(actuator.name)
    if names:
        levers = "its lever never does" if len(names) == 1 else "their levers never do"
        verb = "moves" if len(names) == 1 else "move"
        yield f"{', '.join(names)} {verb}, and {levers}: is the lever in another column?"
