"""What ``/metrics`` serves, as Markdown: made from a heartbeat that has everything."""

from __future__ import annotations

import msgspec

from rampe_guard import wire
from rampe_guard.core.config import InputConfig
from rampe_guard.core.monitor import InputMonitor
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.health import Pulse
from rampe_guard.runtime.metrics import Metrics
from rampe_guard.settings import load_site


def markdown() -> str:
    """A row for each metric."""
    lines = ["| metric | is a | by | tells |", "|---|---|---|---|"]
    for family in _metrics().collect():
        labels = dict.fromkeys(key for s in family.samples for key in s.labels if key != "le")
        by = " ".join(f"`{label}`" for label in labels)
        name = family.name + {"counter": "_total", "info": "_info"}.get(family.type, "")
        lines.append(f"| `{name}` | {family.type} | {by} | {family.documentation} |")
    return "\n".join([*lines, ""])


def _metrics() -> Metrics:
    pulse = Pulse(load_site(shipped_site("bench")), "boot", 0.0, lambda now_s: now_s, "hash")
    pulse.step(0.0, 1.0)
    monitor = InputMonitor(InputConfig(), 0.0)
    refused = {"joystick": {"bad_json": 1}}
    truck = wire.ObjectInput(
        name="truck",
        key="k",
        placed=True,
        age_s=0.0,
        grown_m=0.0,
        rate_hz=10.0,
        accepted=1,
        rejected={"bad_json": 1},
    )
    beat = msgspec.structs.replace(
        pulse.beat(monitor.health(0.0), 0.0, 0, {"learned": 1}),
        reasons=(wire.Reason(code="overload", text="", key=None),),
        rejected=refused,
        alerts={"imminent": 1},
        learned=wire.Learned(categories=1, occurrences=1),
        memory=wire.Remembered(situations=1, work_s=1.0),
        canary=wire.CanaryTrial(result="ok", age_s=0.0),
        commands=wire.Commands(granted={"ack": 1}, refused={"ack": 1}),
        router=True,
        objects=(truck,),
    )
    metrics = Metrics(lambda: 0.0)
    metrics.show(beat, pulse, 0.0)
    return metrics
