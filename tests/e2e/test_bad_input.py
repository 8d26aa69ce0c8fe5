"""Whatever arrives: refused by name, counted, logged sparingly, and never read as clear."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable

import pytest

from tests.support.processes import until
from tests.support.rig import Rig
from tests.support.station import REST, TIMEOUT_S, Station

pytestmark = pytest.mark.e2e

Q = list(REST)
FEED_S, MOST_S, LATE = 3.0, 20.0, 4


def stamped(offset_s: float, **fields: object) -> dict[str, object]:
    return {"stamp": time.time() + offset_s, **fields}


# input, reason in the counter, what is put
GARBAGE: list[tuple[str, str, Callable[[Rig], None]]] = [
    ("joystick", "wildcard_key", lambda r: r.lever(stamped(0, axes=[0] * 4), "rampe/*/*/joystick")),
    (
        "actuators",
        "wildcard_key",
        lambda r: r.actuators(stamped(0, position=Q), "rampe/**/actuator$*"),
    ),
    ("joystick", "bad_json", lambda r: r.lever(b'{"axes": [0, 0')),
    ("actuators", "bad_json", lambda r: r.actuators(b"\xff\xfe\x00")),
    ("joystick", "too_large", lambda r: r.lever(b'{"axes":[0,0,0,0]}' + b" " * 70_000)),
    ("actuators", "too_large", lambda r: r.actuators(b"[" * 70_000)),
    ("joystick", "wrong_length", lambda r: r.lever(stamped(0, axes=[0.0]))),
    ("actuators", "wrong_length", lambda r: r.actuators(stamped(0, position=[*Q, 0.0]))),
    ("joystick", "not_finite", lambda r: r.lever(b'{"axes": [NaN, 0, 0, 0]}')),
    ("actuators", "not_finite", lambda r: r.actuators(b'{"position": [Infinity, 0, 0, 0]}')),
    ("joystick", "axis_out_of_range", lambda r: r.lever(stamped(0, axes=[0, 1.5, 0, 0]))),
    (
        "actuators",
        "position_out_of_range",
        lambda r: r.actuators(stamped(0, position=[Q[0], 0.3, *Q[2:]])),
    ),
    ("joystick", "stamp_back", lambda r: r.lever(stamped(-30.0, axes=[0] * 4))),
    ("actuators", "stamp_back", lambda r: r.actuators(stamped(-30.0, position=Q))),
    ("joystick", "stamp_jump", lambda r: r.lever(stamped(3600.0, axes=[0] * 4))),
    ("actuators", "stamp_jump", lambda r: r.actuators(stamped(3600.0, position=Q))),
    ("actuators", "position_jump", lambda r: r.actuators(stamped(0, position=[-2.9, *Q[1:]]))),
]
NAMES = [f"{name}-{reason}" for name, reason, _ in GARBAGE]
# the gate takes what five times the top speed could reach: after a second, nearly anywhere
ENDLESS = [put for _, reason, put in GARBAGE if reason != "position_jump"]


def rejected(live: Station) -> Counter[tuple[str, str]]:
    (state,) = live.ears.ask(f"{live.site.keys.base}/state")
    table = state["heartbeat"]["rejected"]
    return Counter({(i, r): n for i, counts in table.items() for r, n in counts.items()})


@pytest.mark.parametrize(
    ("name", "reason", "put"), GARBAGE, ids=[f"{i}-{r}" for i, r, _ in GARBAGE]
)
def test_each_kind_is_counted_by_its_reason(
    live: Station, name: str, reason: str, put: Callable[[Rig], None]
) -> None:
    before = rejected(live)
    put(live.rig)
    until(lambda: rejected(live)[name, reason] > before[name, reason], 2.0, f"{name} {reason}")
    other = rejected(live) - before
    assert set(other) == {(name, reason)}, "something else was refused too"


def test_fed_only_garbage_it_says_not_monitoring_and_clears_nothing(live: Station) -> None:
    live.calm()
    live.press_on_crate()
    rig, ears = live.rig, live.ears
    rig.joystick_on = rig.actuators_on = False
    time.sleep(0.05)  # the last good ones are through
    said_before = Counter(re.findall(r"(\S+): refused: (\w+):", live.guard.err))
    before = rejected(live)
    start_s = time.monotonic()
    late: list[str] = []
    while time.monotonic() - start_s < FEED_S or len(late) < LATE:
        for put in ENDLESS:
            put(rig)
            time.sleep(0.002)
        assert time.monotonic() - start_s < MOST_S, "no heartbeats"
        beats = ears.since(start_s + 0.4, "heartbeat")  # the first may still be of before
        late = [b.body["status"] for b in beats if b.at_s > start_s + TIMEOUT_S + 0.5]

    assert "ok" not in {b.body["status"] for b in beats}
    assert set(late) == {"not_monitoring"}
    alerts = [h.body for h in ears.since(start_s, "alert") if h.body["zone"] is not None]
    assert {(b["zone"], b["level"]) for b in alerts} == {("crate", "imminent")}
    assert {b["quality"] for b in alerts[-3:]} == {"stale"}

    grown = rejected(live) - before
    assert {(i, r) for i, r, _ in GARBAGE} - set(grown) == {("actuators", "position_jump")}
    assert sum(grown.values()) > 100
    said = Counter(re.findall(r"(\S+): refused: (\w+):", live.guard.err)) - said_before
    allowed = int(time.monotonic() - start_s) + 2  # one a second and kind
    assert max(said.values()) <= allowed, said

    back_s = time.monotonic()
    rig.joystick_on = rig.actuators_on = True
    ears.wait("alert", lambda b: b["zone"] == "crate" and b["quality"] != "stale", 5.0, back_s)
    live.calm()
