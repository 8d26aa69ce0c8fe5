"""Messages of the contract with plain values, to be changed by `msgspec.structs.replace`."""

from __future__ import annotations

from rampe_guard.wire import (
    Alert,
    Heartbeat,
    InputAges,
    InputRates,
    Quantiles,
    Reason,
    State,
)

BASE = "rampe/quarry-north/excavator-7/guard"
HEARTBEAT = Heartbeat(
    boot_id="boot-1",
    seq=1,
    site="quarry-north",
    machine="excavator-7",
    status="ok",
    reasons=(),
    input_age_s=InputAges(joystick_s=0.01, actuators_s=0.01),
    rates_hz=InputRates(joystick=50.0, actuators=50.0),
    accepted={},
    rejected={},
    primitives={},
    drops=None,
    loop_ms=Quantiles(p50=1.1, p99=4.2),
    sweep_ms=None,
    tick=7,
    scene_hash="",
    config_hash="",
    version="0.1.0",
    published_unix_s=1e9,
    uptime_s=1.0,
)
SILENT_JOYSTICK = Reason(code="joystick_silent", text="no joystick for 1.2 s", key="rampe/j")
ALERT = Alert(
    alert_id="boot-1.wall.1",
    boot_id="boot-1",
    seq=1,
    site="quarry-north",
    machine="excavator-7",
    source="intent",
    level="warning",
    previous_level="clear",
    state="unacked",
    inhibit="none",
    quality="good",
    zone="wall",
    link="bucket",
    probability=0.83,
    time_to_collision_s=1.4,
    clearance_m=0.0,
    clearance_now_m=0.9,
    contact_point_m=None,
    contact_fraction=0.6,
    any_path=None,
    category=(1, 0),
    observations=12,
    predicted_displacement=None,
    predicted_endpoint=None,
    stamp=12.0,
    published_unix_s=1e9,
    input_age_s=0.01,
    compute_ms=1.0,
    raised_unix_s=1e9,
    changed_unix_s=1e9,
    acked_by=None,
    expires_after_s=1.0,
    text="bucket → wall in 1.4 s",
)
STATE = State(heartbeat=HEARTBEAT, alerts=(), predictions=(), position=None)
