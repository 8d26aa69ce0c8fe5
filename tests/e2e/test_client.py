"""`rampe_guard.client` against a router and guards in processes of their own."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import pytest

import rampe_guard as rg
from rampe_guard.client import (
    Alert,
    Alerts,
    AsyncAlerts,
    GuardRestarted,
    Item,
    MessagesLost,
    Protection,
    ProtectionBack,
    ProtectionLost,
)
from rampe_guard.client.items import alert_from
from rampe_guard.client.machine import MachineState
from rampe_guard.dashboard.feed import Feed
from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.hearing import EVERYONE, FLEET, Hall, gather, hall, of, shown, speaker
from tests.support.messages import ALERT
from tests.support.processes import BENCH, free_endpoint, until

pytestmark = pytest.mark.e2e


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hall]:
    """Three guards that speak."""
    with hall(tmp_path_factory.mktemp("hall")) as made:
        yield made


@pytest.fixture
def alerts(place: Hall) -> Iterator[Alerts]:
    """A client of all three, its present read."""
    with Alerts(place.endpoint, EVERYONE) as made:
        gather(made, lambda items: len(items) == len(FLEET))
        yield made


def test_who_comes_late_has_the_present_at_once(place: Hall) -> None:
    place.say(FLEET[1], alert={"alert_id": "late.1", "level": "imminent"})
    with rg.client.Alerts(place.endpoint, EVERYONE) as first:
        gather(first, shown)
        with Alerts(place.endpoint, EVERYONE) as alerts:
            machines = alerts.machines
            assert sorted(machines) == FLEET
            assert {m.protection for m in machines.values()} == {Protection.MONITORING}
            assert [a.zone for a in machines[FLEET[1]].active] == ["wall"]
            items = gather(alerts, lambda items: len(items) == len(FLEET) + 1)
            assert shown(items) == [("excavator-2", "wall", "imminent", "unacked")]
            assert sum(isinstance(item, ProtectionBack) for item in items) == len(FLEET)
            place.say(FLEET[1], alert={"alert_id": "late.1", "level": "clear", "state": "normal"})
            (clear,) = gather(alerts, lambda items: items)
            assert shown([clear]) == [("excavator-2", "wall", "clear", "normal")]
            assert alerts.machines[FLEET[1]].alerts == ()


def test_transitions_come_once_and_repeats_if_asked_for(place: Hall, alerts: Alerts) -> None:
    with Alerts(place.endpoint, EVERYONE, repeats=True) as all_of_it:
        place.say(alert={"alert_id": "once.1"})
        repeated = gather(all_of_it, lambda items: len(shown(items)) >= 4)
    place.say(alert={"alert_id": "once.1", "level": "clear", "state": "normal"})
    told = gather(alerts, lambda items: len(items) == 2)
    assert [level for *_, level, _ in shown(told)] == ["warning", "clear"]
    assert {level for *_, level, _ in shown(repeated)} == {"warning"}
    assert alerts.get(timeout_s=0.3) is None


def test_an_acknowledgement_reaches_the_guard_and_everyone(place: Hall, alerts: Alerts) -> None:
    place.say(alert={"alert_id": "ack.1"})
    (raised,) = gather(alerts, lambda items: items)
    assert isinstance(raised, Alert)
    answer = alerts.acknowledge(raised, who="integrator")
    assert (answer.state, answer.acked_by, answer.base) == ("acked", "integrator", FLEET[0])
    (told,) = gather(alerts, lambda items: items)
    assert isinstance(told, Alert)
    assert told.acked_by == "integrator"
    place.say(alert={"alert_id": "ack.1", "level": "clear", "state": "normal"})
    gather(alerts, lambda items: items)
    with pytest.raises(ConnectionFailedError, match=r"no alert 'ack\.1' waits"):
        alerts.acknowledge(raised, who="integrator")


def test_lost_messages_are_told_and_a_lost_clear_is_found_out(place: Hall, alerts: Alerts) -> None:
    place.say(alert={"alert_id": "lost.1"})
    gather(alerts, lambda items: items)
    place.say(lose=3)
    place.say(alert={"alert_id": "lost.2", "zone": "roof"})
    items = gather(alerts, of(Alert))
    (lost,) = (item for item in items if isinstance(item, MessagesLost))
    assert (lost.count, lost.key) == (3, f"{FLEET[0]}/alert")
    place.say(forget=True)
    items = gather(alerts, lambda items: len(shown(items)) == 2)
    assert {(zone, state) for _, zone, _, state in shown(items)} == {
        ("wall", "normal"),
        ("roof", "normal"),
    }
    assert all(isinstance(item, Alert) and item.inferred for item in items)


def test_an_alert_in_words_that_we_do_not_know_is_never_clear(place: Hall, alerts: Alerts) -> None:
    place.say(raw='{"schema": "rampe.alert.v2", "level": "doom"}')
    (lost,) = gather(alerts, lambda items: items)
    assert isinstance(lost, ProtectionLost)
    assert "cannot be read" in lost.text
    gather(alerts, of(ProtectionBack))


def test_a_dashboard_is_as_suspicious(place: Hall) -> None:
    site = load_site(BENCH)
    stop = StopFlag()
    feed = Feed(
        replace(
            site,
            keys=replace(site.keys, base=FLEET[0]),
            zenoh=replace(site.zenoh, connect=(place.endpoint,)),
        ),
        stop,
    )
    feed.start()

    def guard() -> MachineState:
        return feed.poll(time.monotonic()).guard

    try:
        until(lambda: guard().protection is Protection.MONITORING, 10.0, "a guard that monitors")
        place.say(raw='{"schema": "rampe.alert.v2", "level": "doom"}')
        until(lambda: guard().protection is Protection.UNAVAILABLE, 5.0, "no protection")
        assert "cannot be read" in guard().reasons[0]
        until(lambda: guard().protection is Protection.MONITORING, 5.0, "protection again")
    finally:
        stop.set()
        feed.close()


def test_not_monitoring_and_a_wedged_guard_are_told(place: Hall, alerts: Alerts) -> None:
    reason = {"code": "joystick_silent", "text": "no joystick for 1.2 s"}
    place.say(FLEET[2], beat={"status": "not_monitoring", "reasons": [reason]})
    (lost,) = gather(alerts, lambda items: items)
    assert isinstance(lost, ProtectionLost)
    assert lost.protection is Protection.NOT_MONITORING
    assert lost.text == "NOT MONITORING: no joystick for 1.2 s"
    place.say(FLEET[2], beat={"status": "ok"})
    gather(alerts, of(ProtectionBack))
    place.say(FLEET[2], silent=True)  # its token lives on
    (lost,) = gather(alerts, lambda items: items)
    assert isinstance(lost, ProtectionLost)
    assert lost.protection is Protection.UNAVAILABLE
    place.say(FLEET[2], silent=False)
    gather(alerts, of(ProtectionBack))


def test_a_dead_guard_and_its_successor_are_told(place: Hall) -> None:
    base = "rampe/quarry/crane-1/guard"
    with Alerts(place.endpoint, base) as alerts:
        (lost,) = gather(alerts, lambda items: items)
        assert isinstance(lost, ProtectionLost)  # expected by name, and not there
        with speaker(place.folder, place.endpoint, [base]) as voice:
            gather(alerts, of(ProtectionBack))
            voice.tell('{"alert": {"alert_id": "old.1"}}')
            gather(alerts, of(Alert))
            killed_s = time.monotonic()
            voice.signal_and_wait(signal.SIGKILL)
            (lost,) = gather(alerts, lambda items: items)
            assert isinstance(lost, ProtectionLost)
            assert time.monotonic() - killed_s < 1.5
            assert len(alerts.machines[base].alerts) == 1  # not known to be over
        with speaker(place.folder, place.endpoint, [base]) as voice:
            voice.tell('{"beat": {"boot_id": "boot-2"}}')
            items = gather(alerts, shown)
            assert of(GuardRestarted)(items)
            assert shown(items) == [("crane-1", "wall", "clear", "normal")]


def test_closing_ends_the_iteration_in_another_thread(place: Hall) -> None:
    alerts = Alerts(place.endpoint, EVERYONE)
    heard: list[Item] = []
    with alerts:
        reader = threading.Thread(target=lambda: heard.extend(alerts))
        reader.start()
        machine = alerts.machines[FLEET[0]]
    reader.join(5.0)
    assert not reader.is_alive()
    assert len(heard) == len(FLEET)
    assert alerts.get() is None
    with pytest.raises(ConnectionFailedError, match="closed"):
        alerts.acknowledge(alert_from(ALERT, FLEET[0], 0.0), who="me")
    assert machine.protection is Protection.MONITORING


def test_the_same_in_an_event_loop(place: Hall) -> None:
    async def listen() -> list[Item]:
        items: list[Item] = []
        async with AsyncAlerts(place.endpoint, EVERYONE) as alerts:
            assert sorted(alerts.machines) == FLEET
            place.say(alert={"alert_id": "loop.1"})
            async for item in alerts:
                items.append(item)
                if isinstance(item, Alert) and item.state == "unacked":
                    await alerts.acknowledge(item, who="loop")
                if isinstance(item, Alert) and item.state == "acked":
                    break
            task = asyncio.create_task(anext(aiter(alerts)))
            await asyncio.sleep(0.05)
            assert not task.done()
        with pytest.raises(StopAsyncIteration):
            await task
        return items

    items = asyncio.run(asyncio.wait_for(listen(), 10.0))
    assert [state for *_, state in shown(items)] == ["unacked", "acked"]
    place.say(alert={"alert_id": "loop.1", "level": "clear", "state": "normal"})


def test_twenty_clients_at_once_hear_the_same(place: Hall) -> None:
    heard: list[list[Item]] = []
    all_ears = threading.Barrier(21)

    def listen() -> None:
        with Alerts(place.endpoint, EVERYONE, timeout_s=10.0) as alerts:
            raised = gather(alerts, shown, 20.0)
            all_ears.wait(20.0)
            heard.append([*raised, *gather(alerts, shown, 20.0)])

    place.say(alert={"alert_id": "many.1"})
    readers = [threading.Thread(target=listen) for _ in range(20)]
    for reader in readers:
        reader.start()
    all_ears.wait(20.0)
    place.say(alert={"alert_id": "many.1", "level": "clear", "state": "normal"})
    for reader in readers:
        reader.join(20.0)
    assert [[state for *_, state in shown(items)] for items in heard] == [
        ["unacked", "normal"]
    ] * 20


def test_what_cannot_be_is_said_by_name() -> None:
    endpoint = free_endpoint()
    with pytest.raises(ConnectionFailedError, match=endpoint), Alerts(endpoint, timeout_s=0.1):
        pass
    with pytest.raises(SettingsError, match="endpoints look like"), Alerts("nonsense"):
        pass


def test_a_key_expression_that_is_none_is_refused(place: Hall) -> None:
    with pytest.raises(SettingsError, match="is no key expression"), Alerts(place.endpoint, "a//b"):
        pass


def test_a_router_that_goes_takes_protection_away_and_gives_it_back(place: Hall) -> None:
    """The last test of the module: the others have no use for the router that follows."""
    with Alerts(place.endpoint, FLEET[0]) as alerts:
        gather(alerts, of(ProtectionBack))
        place.router.signal_and_wait(signal.SIGKILL)
        gather(alerts, of(ProtectionLost))
        with processes.router(place.folder, place.endpoint):
            items = gather(alerts, of(ProtectionBack))
            assert shown(items) == []
