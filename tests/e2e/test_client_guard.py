"""The client programs of the documentation, as they stand there, beside a real guard."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rampe_guard.client import Alert, Alerts, Protection
from rampe_guard.errors import ConnectionFailedError
from tests.support.hearing import gather, shown
from tests.support.processes import ROOT, Process
from tests.support.station import Station

pytestmark = pytest.mark.e2e

PAGE = ROOT / "deploy" / "docs" / "howto" / "integrate.md"
PROGRAMS = re.findall(
    r"<!-- run: client -->\n```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL
)


def test_the_page_shows_both_clients() -> None:
    assert ["AsyncAlerts" in text for text in PROGRAMS] == [False, True]


def test_the_programs_of_the_page_and_a_client_follow_a_real_guard(
    live: Station, tmp_path: Path
) -> None:
    live.calm()
    live.press_on_crate()
    base, name = live.site.keys.base, live.site.machine
    with Alerts(live.endpoint, base) as alerts:
        machine = alerts.machines[base]
        assert machine.protection is Protection.MONITORING
        (crate,) = (alert for alert in machine.active if alert.zone == "crate")
        assert crate.level == "imminent"
        with pytest.raises(ConnectionFailedError, match="imminent"):
            alerts.shelve(crate, who="tester", duration_s=5.0)

        running = []
        for text in PROGRAMS:
            assert "tcp/127.0.0.1:7447" in text
            text = text.replace("tcp/127.0.0.1:7447", live.endpoint)  # noqa: PLW2901
            text = text.replace("rampe/*/*/guard", f"{base.rpartition('/')[0]}/*")  # noqa: PLW2901
            running.append(Process(tmp_path, "program", ["-u", "-c", text]))
        try:
            running[0].wait_for(f"{name} monitoring ['", 30.0)
            running[0].wait_for(f"{name} imminent ", 10.0)  # acknowledges it
            gather(alerts, lambda items: (name, "crate", "imminent", "acked") in shown(items))
            running[1].wait_for(f"{name} imminent ", 30.0)
            live.calm()
            running[0].wait_for(f"{name} crate clear", 10.0)
            running[1].wait_for(f"{name} clear ", 10.0)
        finally:
            for process in running:
                process.close()
        gather(alerts, lambda items: any(isinstance(i, Alert) and i.over for i in items))
        assert "Traceback" not in running[0].err + running[1].err
        assert not [a for a in alerts.machines[base].active if a.zone == "crate"]
