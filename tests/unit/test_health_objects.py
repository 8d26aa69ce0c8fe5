"""What the heartbeat says of objects that move."""

from __future__ import annotations

from rampe_guard.core.config import InputConfig
from rampe_guard.core.monitor import Health, InputMonitor
from rampe_guard.core.moving import MovingObjects
from rampe_guard.core.types import Inputs
from rampe_guard.runtime.health import Pulse, Rates
from rampe_guard.settings import load_site
from rampe_guard.wire import Heartbeat
from tests.support.movers import seen, truck
from tests.support.processes import BENCH


def beat(pulse: Pulse, moving: MovingObjects, now_s: float) -> Heartbeat:
    monitor = InputMonitor(InputConfig(), 0.0)
    monitor.accept("joystick", now_s)
    monitor.accept("actuators", now_s)
    health = monitor.health(now_s, moving.weaknesses(now_s))
    known = Health(
        health.status,
        health.reasons,
        health.ages_s,
        health.accepted,
        health.rejected,
        objects=moving.health(now_s),
    )
    return pulse.beat(known, now_s, 0, {})


def test_every_object_has_its_line() -> None:
    pulse = Pulse(load_site(BENCH), "boot", 0.0, lambda now_s: now_s, "hash")
    moving = MovingObjects([truck("truck"), truck("van")], InputConfig())
    moving.take(Inputs(objects=(seen(1.0, 1.0),)), 1.0)
    first = beat(pulse, moving, 1.0)
    assert [(o.name, o.rate_hz) for o in first.objects] == [("truck", None), ("van", None)]
    samples = tuple(seen(1.0, 1.0 + 0.1 * k) for k in range(1, 11))
    moving.take(Inputs(objects=samples, objects_rejected=(("van", "bad_json"),)), 2.0)
    message = beat(pulse, moving, 2.25)
    known, lost = message.objects
    assert (known.key, known.placed, known.accepted) == ("site/truck/pose", True, 11)
    assert (known.age_s, known.grown_m, known.rate_hz) == (0.25, 0.5, 8.0)
    assert (lost.placed, lost.age_s, lost.grown_m, lost.rate_hz) == (False, None, None, 0.0)
    assert lost.rejected == {"bad_json": 1}
    assert message.status == "degraded"
    assert [(r.code, r.key) for r in message.reasons] == [
        ("object_silent", "site/van/pose"),
        ("object_bad_json", "site/van/pose"),
    ]


def test_rates_are_of_the_last_two_seconds() -> None:
    rates = Rates()
    assert rates.update(0.0, {"a": 0})("a") is None
    for k in range(1, 31):
        rate = rates.update(0.2 * k, {"a": min(20 * k, 200)})
        if k == 10:
            assert rate("a") == 100.0
    assert rate("a") == 0.0
    assert rate("b") == 0.0
