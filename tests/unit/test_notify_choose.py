"""What is told of the items of a client: transitions at a level, ends, protection; nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from msgspec import structs

from rampe_guard.client import Alert, Item, MachineState, MessagesLost, Protection
from rampe_guard.client.contact import Contact
from rampe_guard.client.items import ProtectionBack, ProtectionLost, alert_from
from rampe_guard.core.alarm import Level
from rampe_guard.notify.choose import Notice, notice_of, notices_of
from rampe_guard.notify.sound import sounding
from rampe_guard.notify.tones import IMMINENT, RATE_HZ, TONES, UNPROTECTED, WARNING, samples
from tests.support.messages import ALERT, BASE, HEARTBEAT


def alert(**change: Any) -> Alert:
    return alert_from(structs.replace(ALERT, **change), BASE, 10.0)


def lost(protection: Protection) -> ProtectionLost:
    level, text = "warning", "PROTECTION UNAVAILABLE"
    fields: dict[str, Any] = {"base": BASE, "site": "s", "machine": "m", "level": level}
    return ProtectionLost(protection=protection, text=text, **fields)


BACK = ProtectionBack(
    base=BASE, site="s", machine="m", protection=Protection.MONITORING, level="clear", text="ok"
)


def told(item: Item, at_least: Level = Level.WARNING) -> tuple[str, bool] | None:
    notice = notice_of(item, at_least)
    return None if notice is None else (notice.subject, notice.over)


@pytest.mark.parametrize(
    ("change", "at_least", "over"),
    [
        ({}, Level.WARNING, False),
        ({"level": "imminent"}, Level.IMMINENT, False),
        ({"level": "caution"}, Level.CAUTION, False),
        ({"level": "caution"}, Level.WARNING, True),
        ({"level": "warning"}, Level.IMMINENT, True),
        ({"state": "acked"}, Level.WARNING, False),
        ({"inhibit": "shelved"}, Level.WARNING, True),
        ({"level": "clear", "state": "rtn_unacked"}, Level.CAUTION, True),
        ({"level": "clear", "state": "normal"}, Level.CAUTION, True),
    ],
)
def test_alerts_are_told_from_a_level_on_and_so_is_their_end(
    change: dict[str, Any], at_least: Level, *, over: bool
) -> None:
    assert told(alert(**change), at_least) == ("zone wall", over)


def test_protection_is_told_whatever_the_level() -> None:
    for protection in (Protection.UNAVAILABLE, Protection.NOT_MONITORING):
        assert told(lost(protection), Level.IMMINENT) == ("protection", False)
    assert told(lost(Protection.MACHINE_OFF)) == ("protection", True)
    assert told(BACK) == ("protection", True)


def test_not_monitoring_is_not_told_twice() -> None:
    system: dict[str, Any] = {"zone": None, "source": "system"}
    assert told(alert(**system, level="warning")) is None
    assert told(alert(**system, level="clear", state="rtn_unacked")) == ("zone None", True)
    # "guard restarted after a crash" is nobody else's to tell
    assert told(alert(**system, level="caution"), Level.CAUTION) == ("zone None", False)


def test_what_was_lost_on_the_way_is_not_for_targets() -> None:
    item = MessagesLost(
        base=BASE, site="s", machine="m", key="k", count=1, level="caution", text="1 lost"
    )
    assert notice_of(item, Level.CAUTION) is None


def notice(**change: Any) -> Notice:
    found = notice_of(alert(**change), Level.WARNING)
    assert found is not None
    return found


def test_a_notice_is_the_message_and_what_it_means() -> None:
    body = notice().body
    assert (body["event"], body["over"], body["base"]) == ("alert", False, BASE)
    assert body["schema"] == "rampe.alert.v1"
    assert not {"received_s", "sent_s"} & body.keys()


def test_the_same_twice_is_known() -> None:
    first = notice()
    assert first.same(notice(seq=9, published_unix_s=1e9 + 9.0, changed_unix_s=1e9 + 1e-3))
    for change in ({"level": "imminent"}, {"state": "acked"}, {"changed_unix_s": 1e9 + 20.0}):
        assert not first.same(notice(**change))
    assert not first.same(None)


def machine(*alerts: Alert, now_s: float = 10.1, **change: Any) -> MachineState:
    heartbeat = structs.replace(HEARTBEAT, **change)
    made = MachineState(BASE, now_s, 0.0, 1.0, heartbeat=heartbeat, contact=Contact(beat_s=10.0))
    return replace(made, alerts=alerts)


def test_all_that_is_active_can_be_told_again() -> None:
    alerts = (alert(), alert(alert_id="b", zone="b", level="caution"), alert(inhibit="shelved"))
    assert [n.subject for n in notices_of(machine(*alerts), Level.WARNING)] == ["zone wall"]


def test_what_nobody_has_seen_sounds_and_nothing_else_does() -> None:
    assert sounding([machine()], Level.WARNING) is None
    assert sounding([machine(alert())], Level.WARNING) is WARNING
    assert sounding([machine(alert())], Level.IMMINENT) is None
    assert sounding([machine(alert(), alert(level="imminent"))], Level.WARNING) is IMMINENT
    assert sounding([machine(alert(level="caution"))], Level.CAUTION) is None
    quiet = [alert(state="acked"), alert(inhibit="shelved"), alert(level="clear")]
    assert sounding([machine(*quiet)], Level.WARNING) is None


def test_lost_protection_sounds_until_it_is_back_or_acknowledged_at_the_guard() -> None:
    assert sounding([machine(now_s=12.0)], Level.IMMINENT) is UNPROTECTED
    # what is no longer known to be so does not sound, but that it is not known does
    assert sounding([machine(alert(level="imminent"), now_s=12.0)], Level.WARNING) is UNPROTECTED
    blind: dict[str, Any] = {"status": "not_monitoring"}
    system = alert(zone=None, source="system")
    assert sounding([machine(system, **blind)], Level.IMMINENT) is UNPROTECTED
    seen = alert(zone=None, source="system", state="acked")
    assert sounding([machine(seen, **blind)], Level.IMMINENT) is None
    assert sounding([machine(seen, now_s=12.0, **blind)], Level.IMMINENT) is UNPROTECTED


def test_tones_differ_by_pulse_and_pitch_and_do_not_clip() -> None:
    for tone in TONES:
        sound = samples(tone)
        assert 0.2 < len(sound) / RATE_HZ <= tone.period_s
        assert 10_000 < abs(sound.astype(int)).max() < 32_767
        assert abs(int(sound[0])) < 100  # no click
    assert len({(t.period_s, t.beeps) for t in TONES}) == len(TONES)
    assert [len(t.beeps) / t.period_s for t in (IMMINENT, WARNING)] == [4.0, 1.0]
