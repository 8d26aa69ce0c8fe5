"""What a service manager hears, on a real datagram socket."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from rampe_guard.runtime.minders import Minders
from rampe_guard.runtime.systemd import MAX_STATUS, Watchdog
from rampe_guard.runtime.turning import PIPE, Turning
from tests.support.manager import Manager


@pytest.fixture(params=["path", "abstract"])
def manager(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Manager]:
    path = str(tmp_path / "notify")
    made = Manager(path if request.param == "path" else f"@{path}")
    yield made
    made.close()


def test_it_hears_what_it_is_told(manager: Manager) -> None:
    told = Watchdog({"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "8000000"})
    told.status("loading")
    told.ready()
    told.status("loading")  # no news
    told.status("ok")
    told.stopping()
    assert manager.heard() == ["STATUS=loading", "READY=1", "STATUS=ok", "STOPPING=1"]
    told.close()
    told.ready()
    assert manager.heard() == []


def test_the_watchdog_is_fed_a_few_times_within_what_it_waits(manager: Manager) -> None:
    told = Watchdog({"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "2000000"})
    assert told.period_s == 0.5
    for turn in range(2001):  # two seconds of a loop that turns each millisecond
        told.feed(100.0 + turn * 1e-3)
    assert manager.heard() == ["WATCHDOG=1"] * 5
    assert Watchdog({"WATCHDOG_USEC": "60000000"}).period_s == 1.0
    told.close()


@pytest.mark.parametrize("usec", ["", "0", "-5", "soon"])
def test_without_a_watchdog_nothing_is_fed(manager: Manager, usec: str) -> None:
    told = Watchdog({"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": usec})
    told.feed(0.0)
    told.feed(1e6)
    assert manager.heard() == []
    told.close()


def test_a_status_is_one_short_line(manager: Manager) -> None:
    told = Watchdog({"NOTIFY_SOCKET": manager.address})
    told.status("a\nREADY=1\n" + "x" * 1000)
    (line,) = manager.heard()
    assert line.startswith("STATUS=a READY=1 x")
    assert len(line) == len("STATUS=") + MAX_STATUS
    told.close()


@pytest.mark.parametrize("address", ["", "@", "relative/path", "/nowhere/at/all", "@nobody"])
def test_who_has_no_manager_is_not_stopped(address: str) -> None:
    told = Watchdog({"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "1000000"})
    told.ready()
    told.feed(0.0)
    told.status("ok")
    told.stopping()
    told.close()


def test_a_manager_that_does_not_read_keeps_nobody_waiting(manager: Manager) -> None:
    told = Watchdog({"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "1000000"})
    for turn in range(5000):  # far more than the socket holds
        told.feed(float(turn))
    assert 0 < len(manager.heard()) < 5000
    told.ready()
    assert manager.heard() == ["READY=1"]
    told.close()


def test_ready_is_said_once_with_the_first_status(
    manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    near, far = os.pipe()
    monkeypatch.setenv("NOTIFY_SOCKET", manager.address)
    monkeypatch.setenv(PIPE, str(far))
    minders = Minders()
    assert PIPE not in os.environ  # not for who is started by the guard
    assert not os.get_inheritable(far)
    minders.waiting("waiting for a Zenoh router")
    minders.turn(1.0)
    minders.turn(1.5)
    minders.turn(2.0)
    minders.status("status ok")
    minders.status("status degraded")
    minders.ending()
    assert manager.heard() == [
        "STATUS=waiting for a Zenoh router",
        "READY=1",
        "STATUS=status ok",
        "STATUS=status degraded",
        "STOPPING=1",
    ]
    assert os.read(near, 100) == b"..e"
    os.close(near)
    os.close(far)


def test_a_supervisor_that_does_not_listen_keeps_nobody_waiting() -> None:
    near, far = os.pipe()
    turning = Turning({PIPE: str(far)})
    for turn in range(70_000):  # more than a pipe holds
        turning.feed(float(turn))
    os.close(near)
    turning.feed(1e6)  # and none at all
    turning.end()
    os.close(far)
