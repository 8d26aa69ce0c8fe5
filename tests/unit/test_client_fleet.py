"""Many machines from messages and time: nothing becomes clear because something did not come."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from msgspec import structs

from rampe_guard import wire
from rampe_guard.client import fleet as core
from rampe_guard.client.fleet import Fleet
from rampe_guard.client.items import (
    Alert,
    Item,
    MessagesLost,
    Protection,
    ProtectionBack,
    ProtectionLost,
)
from rampe_guard.client.machine import MachineState
from tests.support.messages import ALERT, BASE, HEARTBEAT, SILENT_JOYSTICK, STATE

OFF = wire.Reason(code="machine_off", text="the machine is switched off")


class Listener:
    """A fleet, and what was told."""

    def __init__(self) -> None:
        self.fleet = Fleet()
        self.items: list[Item] = []
        self.now_s = 100.0
        self.booted_s = 40.0
        self.unix_s = 1.7e9

    def sent(self, late_s: float = 0.0) -> dict[str, float]:
        """The guard's clocks in a message that was on its way for so long [s]."""
        sent_s = self.now_s - late_s
        return {"uptime_s": sent_s - self.booted_s, "published_unix_s": self.unix_s + sent_s}

    @property
    def machine(self) -> MachineState:
        return self.fleet.machines[BASE]

    def beat(self, seq: int, late_s: float = 0.0, **change: Any) -> None:
        message = structs.replace(HEARTBEAT, seq=seq, **self.sent(late_s), **change)
        self._keep(core.on_heartbeat(self.fleet, BASE, message, self.now_s))

    def alert(self, seq: int, late_s: float = 0.0, **change: Any) -> None:
        message = structs.replace(ALERT, seq=seq, **{**self.sent(late_s), **change})
        self._keep(core.on_alert(self.fleet, BASE, message, self.now_s))

    def state(self, *alerts: wire.Alert, asked_s: float | None = None, **change: Any) -> None:
        heartbeat = structs.replace(HEARTBEAT, **self.sent(), **change)
        alerts = tuple(structs.replace(alert, **self.sent()) for alert in alerts)
        message = structs.replace(STATE, heartbeat=heartbeat, alerts=alerts)
        asked_s = self.now_s if asked_s is None else asked_s
        self._keep(core.on_state(self.fleet, BASE, message, self.now_s, asked_s))

    def token(self, *, alive: bool) -> None:
        self._keep(core.on_token(self.fleet, BASE, self.now_s, alive=alive))

    def wait(self, seconds: float) -> None:
        self.now_s += seconds
        self._keep(core.at(self.fleet, self.now_s))

    def told(self) -> list[Item]:
        """What was told since the last look."""
        items, self.items = self.items, []
        return items

    def _keep(self, told: core.Told) -> None:
        self.fleet, items = told
        self.items += items


@pytest.fixture
def ear() -> Listener:
    """One machine, monitoring."""
    made = Listener()
    made.state()
    assert [type(i) for i in made.told()] == [ProtectionBack]
    return made


def kinds(items: list[Item]) -> list[str]:
    return [type(item).__name__ for item in items]


def levels(items: list[Item]) -> list[tuple[str, str]]:
    return [(i.level, i.state) for i in items if isinstance(i, Alert)]


def test_a_machine_that_is_expected_and_never_heard_is_unavailable() -> None:
    ear = Listener()
    ear._keep(core.expect(ear.fleet, BASE, ear.now_s))
    (lost,) = ear.told()
    assert isinstance(lost, ProtectionLost)
    assert lost.text == "PROTECTION UNAVAILABLE: no guard was heard"
    assert ear.machine.protection is Protection.UNAVAILABLE
    ear.beat(7)
    assert ear.machine.behind  # ask for its state: alerts may stand that were never told
    assert ear.told() == []
    ear.state()
    assert kinds(ear.told()) == ["ProtectionBack"]
    ear._keep(core.expect(ear.fleet, BASE, ear.now_s))
    assert ear.told() == []


@pytest.mark.parametrize(
    ("change", "protection", "level"),
    [
        ({"status": "degraded", "reasons": (SILENT_JOYSTICK,)}, Protection.DEGRADED, "caution"),
        (
            {"status": "not_monitoring", "reasons": (SILENT_JOYSTICK,)},
            Protection.NOT_MONITORING,
            "warning",
        ),
        ({"status": "not_monitoring", "reasons": (OFF,)}, Protection.MACHINE_OFF, "caution"),
        (
            {"status": "not_monitoring", "reasons": (OFF, SILENT_JOYSTICK)},
            Protection.NOT_MONITORING,
            "warning",
        ),
        ({"status": "not_monitoring", "reasons": ()}, Protection.NOT_MONITORING, "warning"),
    ],
)
def test_the_heartbeat_says_what_can_be_relied_on(
    ear: Listener, change: dict[str, Any], protection: Protection, level: str
) -> None:
    ear.beat(2, **change)
    (told,) = ear.told()
    assert isinstance(told, ProtectionBack if protection.guarded else ProtectionLost)
    assert (told.protection, told.level) == (protection, level)
    assert ear.machine.protection is protection
    assert ear.machine.reasons == tuple(r.text for r in change["reasons"])
    ear.beat(3, **change)
    assert ear.told() == []  # said once
    ear.beat(4)
    assert [(type(i), i.level) for i in ear.told()] == [(ProtectionBack, "clear")]


def test_a_silent_guard_is_told_once_and_so_is_its_return(ear: Listener) -> None:
    ear.wait(1.0)
    assert ear.told() == []
    ear.wait(0.1)
    (lost,) = ear.told()
    assert isinstance(lost, ProtectionLost)
    assert lost.text == "PROTECTION UNAVAILABLE: no heartbeat for 1.1 s"
    ear.wait(5.0)
    assert ear.told() == []
    ear.beat(9)
    assert ear.told() == []
    assert ear.machine.reasons == ("the guard is heard again, its alerts are being asked for",)
    ear.state()
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_a_guard_that_tells_no_state_has_told_all_alerts_after_half_a_second(
    ear: Listener,
) -> None:
    ear.wait(2.0)
    ear.told()
    for seq in range(2, 5):
        ear.beat(seq)
        assert ear.machine.protection is Protection.UNAVAILABLE
        ear.wait(0.2)
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_what_a_network_kept_and_hands_on_protects_nobody(ear: Listener) -> None:
    """A router stood still for ten seconds: then all that it kept comes at once."""
    ear.wait(10.0)
    ear.told()
    for seq in range(2, 50):
        ear.beat(seq, late_s=10.0 - 0.18 * seq)
        assert ear.machine.protection is Protection.UNAVAILABLE
    assert ear.told() == []
    ear.beat(50)
    ear.state()
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_an_alert_that_was_kept_on_its_way_is_not_trusted(ear: Listener) -> None:
    ear.alert(1, late_s=1.5)
    assert ear.machine.alerts[0].received_s - ear.machine.alerts[0].sent_s == pytest.approx(1.5)
    assert ear.machine.reasons == ("the alert of wall is not repeated",)
    ear.alert(2)
    assert ear.machine.protection is Protection.MONITORING


@pytest.mark.parametrize("change", ["clock set", "computer slept"])
def test_one_clock_that_jumps_makes_no_message_late(ear: Listener, change: str) -> None:
    if change == "clock set":
        ear.unix_s -= 3600.0
    else:
        ear.booted_s += 600.0
    ear.wait(0.2)
    ear.beat(2)
    assert ear.machine.silence_s == 0.0
    assert ear.told() == []


def test_clocks_that_drift_apart_make_no_message_late(ear: Listener) -> None:
    for seq in range(2, 36_000):  # two hours, half a millisecond lost a second
        ear.wait(0.2)
        ear.booted_s += 1e-4
        ear.unix_s -= 1e-4
        ear.beat(seq)
    assert ear.machine.silence_s == pytest.approx(0.0, abs=1e-3)
    assert ear.told() == []


def test_a_token_that_went_is_told_at_once_until_a_heartbeat_comes(ear: Listener) -> None:
    ear.token(alive=False)
    (lost,) = ear.told()
    assert lost.text == "PROTECTION UNAVAILABLE: the guard, or the network to it, is gone"
    ear.beat(2)
    ear.state()
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_a_token_alone_protects_nobody() -> None:
    ear = Listener()
    ear.token(alive=False)
    assert ear.fleet.machines == {}
    ear.token(alive=True)
    assert ear.machine.protection is Protection.UNAVAILABLE
    assert ear.told() == []  # its first heartbeat may be on the way
    ear.wait(1.1)
    assert kinds(ear.told()) == ["ProtectionLost"]


def test_an_alert_is_told_when_it_changes_and_not_when_it_is_repeated(ear: Listener) -> None:
    published = 1e9
    changes: list[dict[str, Any]] = [
        {},
        {},
        {"level": "imminent", "previous_level": "warning"},
        {"level": "imminent", "state": "acked", "acked_by": "me"},
        {"level": "imminent", "state": "acked", "quality": "stale"},
        {"level": "clear", "state": "rtn_unacked"},
        {"level": "clear", "state": "rtn_unacked"},
        {"level": "clear", "state": "normal"},
    ]
    for seq, change in enumerate(changes, start=1):
        published += 0.2
        ear.alert(seq, published_unix_s=published, **change)
    assert levels(ear.told()) == [
        ("warning", "unacked"),
        ("imminent", "unacked"),
        ("imminent", "acked"),
        ("imminent", "acked"),
        ("clear", "rtn_unacked"),
        ("clear", "normal"),
    ]
    assert ear.machine.alerts == ()


def test_asking_again_is_a_transition_though_nothing_else_changes(ear: Listener) -> None:
    ear.alert(1, published_unix_s=1e9 + 20.0)
    ear.alert(2, published_unix_s=1e9 + 20.2)
    ear.alert(3, published_unix_s=1e9 + 20.4, changed_unix_s=1e9 + 20.4)
    ear.alert(4, published_unix_s=1e9 + 920.6, changed_unix_s=1e9 + 920.4)  # the clock was set
    assert len(ear.told()) == 2


def test_alerts_are_ordered_by_level_then_time_and_shelved_ones_stand_apart(ear: Listener) -> None:
    for seq, (zone, level, time_s, inhibit) in enumerate(
        [
            ("d", "caution", None, "none"),
            ("c", "warning", 3.0, "none"),
            ("s", "warning", 0.1, "shelved"),
            ("b", "warning", 1.0, "none"),
            ("a", "imminent", None, "none"),
        ],
        start=1,
    ):
        ear.alert(
            seq, alert_id=zone, zone=zone, level=level, time_to_collision_s=time_s, inhibit=inhibit
        )
    assert [a.zone for a in ear.machine.active] == ["a", "b", "c", "d"]
    assert [a.zone for a in ear.machine.shelved] == ["s"]
    assert [a.zone for a in ear.machine.alerts] == ["a", "s", "b", "c", "d"]


def test_an_alert_that_is_not_repeated_takes_protection_away(ear: Listener) -> None:
    ear.alert(1)
    ear.told()
    for seq in range(2, 8):
        ear.wait(0.2)
        ear.beat(seq)
    assert ear.machine.behind  # asked for before it expires, so that a lost clear is no scare
    assert ear.machine.expired(ear.machine.alerts[0])
    (lost,) = ear.told()
    assert lost.text == "PROTECTION UNAVAILABLE: the alert of wall is not repeated"
    ear.alert(2)
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_an_alert_that_cannot_be_read_takes_protection_away(ear: Listener) -> None:
    ear._keep(core.on_unreadable(ear.fleet, BASE, ear.now_s))
    ear.beat(2)
    (lost,) = ear.told()
    assert isinstance(lost, ProtectionLost)
    assert lost.text.startswith("PROTECTION UNAVAILABLE: an alert cannot be read")
    ear.wait(0.9)
    ear.beat(3)
    assert ear.told() == []
    ear.wait(0.2)
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_gaps_of_seq_are_counted_and_the_state_is_wanted(ear: Listener) -> None:
    ear.alert(5)
    assert kinds(ear.told()) == ["Alert"]  # nobody knows what went before
    assert not ear.machine.behind
    ear.alert(9)
    (lost,) = ear.told()
    assert isinstance(lost, MessagesLost)
    assert (lost.key, lost.count) == (f"{BASE}/alert", 3)
    assert ear.machine.behind
    ear.beat(1)
    ear.beat(3)
    (lost,) = ear.told()
    assert isinstance(lost, MessagesLost)
    assert (lost.key, lost.count) == (f"{BASE}/heartbeat", 1)
    assert ear.machine.lost == 4


def test_a_message_that_came_already_or_too_late_changes_nothing(ear: Listener) -> None:
    ear.alert(5, level="imminent")
    ear.told()
    ear.alert(5, level="caution")
    ear.alert(4, level="caution")
    assert ear.told() == []
    assert ear.machine.alerts[0].level == "imminent"


def test_a_lost_clear_is_learned_from_the_state_of_a_guard_that_monitors(ear: Listener) -> None:
    ear.alert(1)
    ear.told()
    ear.wait(0.6)
    ear.state(seq=4, asked_s=ear.now_s - 0.01)
    (clear,) = ear.told()
    assert isinstance(clear, Alert)
    assert (clear.level, clear.state, clear.inferred) == ("clear", "normal", True)
    assert "clear" in clear.text
    assert not ear.machine.behind
    ear.alert(2, level="clear", state="normal")  # the clear was only late
    assert ear.told() == []


def test_a_state_ends_nothing_that_was_heard_after_it_was_asked_for(ear: Listener) -> None:
    asked_s = ear.now_s
    ear.wait(0.01)
    ear.alert(1)
    ear.state(asked_s=asked_s)
    assert kinds(ear.told()) == ["Alert"]
    assert len(ear.machine.alerts) == 1
    assert ear.machine.behind  # ask once more


def test_a_state_ends_nothing_while_the_guard_does_not_monitor(ear: Listener) -> None:
    ear.alert(1)
    ear.wait(0.1)
    ear.told()
    ear.state(status="not_monitoring", reasons=(SILENT_JOYSTICK,), seq=3)
    assert kinds(ear.told()) == ["ProtectionLost"]
    assert len(ear.machine.alerts) == 1


def test_a_state_brings_what_was_missed_and_no_alert_that_is_over(ear: Listener) -> None:
    ear.alert(3)
    ear.alert(4, level="clear", state="normal")
    ear.told()
    other = structs.replace(ALERT, alert_id="boot-1.roof.1", zone="roof", seq=2)
    ear.state(ALERT, other)
    assert [(i.zone, i.level) for i in ear.told() if isinstance(i, Alert)] == [("roof", "warning")]
    newer = structs.replace(other, level="imminent", seq=6)
    ear.state(newer)
    assert levels(ear.told()) == [("imminent", "unacked")]
    ear.state(other)  # an answer that was long on its way
    assert ear.told() == []
    assert ear.machine.alerts[0].level == "imminent"


def test_a_new_alert_of_a_zone_ends_the_one_before(ear: Listener) -> None:
    ear.alert(1)
    ear.alert(2, alert_id="boot-1.wall.2", level="caution")
    assert levels(ear.told()) == [
        ("warning", "unacked"),
        ("clear", "normal"),
        ("caution", "unacked"),
    ]


def test_a_restart_is_told_and_its_earlier_alerts_end_when_the_new_guard_sees(
    ear: Listener,
) -> None:
    ear.alert(40)
    ear.wait(0.3)
    ear.told()
    blind: dict[str, Any] = {"status": "not_monitoring", "reasons": (SILENT_JOYSTICK,)}
    ear.beat(1, boot_id="boot-2", **blind)
    assert kinds(ear.told()) == ["GuardRestarted", "ProtectionLost"]
    ear.state(boot_id="boot-2", **blind)
    assert len(ear.machine.alerts) == 1  # nobody knows yet
    assert ear.machine.behind
    ear.beat(2, boot_id="boot-2")
    ear.state(boot_id="boot-2")
    told = ear.told()
    assert kinds(told) == ["ProtectionBack", "Alert"]
    assert levels(told) == [("clear", "normal")]
    assert ear.machine.lost == 0


def test_late_words_of_an_earlier_run_are_ignored_while_the_new_one_speaks(ear: Listener) -> None:
    ear.beat(1, boot_id="boot-2")
    assert kinds(ear.told()) == ["GuardRestarted"]
    ear.beat(50)
    ear.alert(50)
    ear.state()
    assert ear.told() == []
    assert ear.machine.alerts == ()
    ear.wait(3.0)
    ear.beat(51)  # two guards on one key, and the newer one died
    assert kinds(ear.told()) == ["ProtectionLost", "GuardRestarted"]
    ear.state(boot_id=ear.machine.boot_id)
    assert kinds(ear.told()) == ["ProtectionBack"]


def test_machines_are_bounded() -> None:
    fleet = Fleet()
    for i in range(core.MAX_MACHINES + 5):
        fleet, _ = core.on_heartbeat(fleet, f"a/{i}", HEARTBEAT, 1.0)
    assert len(fleet.machines) == core.MAX_MACHINES
    assert core.on_alert(fleet, "b", ALERT, 1.0) == (fleet, ())
    assert core.on_state(fleet, "b", STATE, 1.0, 1.0) == (fleet, ())
    assert core.on_token(fleet, "b", 1.0, alive=True) == (fleet, ())
    assert core.expect(fleet, "b", 1.0) == (fleet, ())
    assert core.on_unreadable(fleet, "b", 1.0) == (fleet, ())


def test_items_are_json_lines_that_name_their_event(ear: Listener) -> None:
    ear.alert(1)
    ear.alert(3)
    ear.beat(1, boot_id="boot-2")
    ear.wait(2.0)
    lines = [msgspec.json.decode(msgspec.json.encode(item)) for item in ear.told()]
    assert [line["event"] for line in lines] == [
        "alert",
        "messages_lost",
        "guard_restarted",
        "protection_lost",
    ]
    assert {"base", "site", "machine", "level", "text"} <= set.intersection(*map(set, lines))
    assert lines[0]["schema"] == "rampe.alert.v1"
    msgspec.json.schema(Item)
