"""From a tally to the closing table that a person reads."""

from __future__ import annotations

from rich.console import RenderableType

from rampe_guard import wire
from rampe_guard.core.alarm import Level
from rampe_guard.evaluate.tally import Tally
from rampe_guard.view.summary import Summary, ZoneTally, summary


def closing_table(
    tally: Tally, cycles: int | None = None, loop_ms: wire.Quantiles | None = None
) -> RenderableType:
    """Contacts, warnings, lead times and false alarms; warnings and above count as warned.

    Args:
        tally: the score.
        cycles: work cycles done, None where nobody counts them.
        loop_ms: loop times of the guard, None where there is no loop.
    """
    zones = [
        ZoneTally(zone, s.contacts, s.leads_s, s.false_alarms, s.unknown_contacts, s.unmonitored)
        for zone, s in tally.scores(Level.WARNING).items()
    ]
    p50, p99 = (loop_ms.p50, loop_ms.p99) if loop_ms else (None, None)
    return summary(
        Summary(
            zones,
            tally.duration_s,
            cycles,
            p50,
            p99,
            blind_s=tally.blind_s,
            inside_at_first_s=tally.inside_at_first_s,
        )
    )
