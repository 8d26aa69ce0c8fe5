"""``rampe-guard dashboard`` in a headless browser, beside a working guard."""

from __future__ import annotations

import contextlib
import http.client
import json
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from tests.support import processes
from tests.support.browser import Browser, Page, chromium
from tests.support.dashboards import (
    BANNER,
    LOST,
    free_port,
    mortal_station,
    replace_guard,
    start_dashboard,
)
from tests.support.processes import BENCH, DEMO, Process, until
from tests.support.sight import SIZE, Scene
from tests.support.station import Station

pytest.importorskip("viser", reason="the dashboard extra is not installed")
pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(chromium() is None, reason="no chromium on this machine"),
]

SOON_S = 20.0
"""Software draws the page, beside other tests: this is no measure (benchmarks/dashboard.py is)."""
LEAST_BLUE = 150
LEAST_RED = 150


@dataclass
class Cab:
    """A guard at work, a dashboard of it and of a machine that nobody guards, and a page."""

    folder: Path
    station: Station
    port: int
    dashboard: Process
    page: Page

    def restart_guard(self) -> None:
        replace_guard(self.folder, self.station)

    def shows(self, words: str) -> None:
        self.page.wait(f"{BANNER}.includes({words!r})", SOON_S)

    def monitored(self) -> None:
        self.page.wait(f"!({LOST})", SOON_S)


@pytest.fixture(scope="module")
def cab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cab]:
    """All of it; the tests below follow one another on the same page."""
    folder = tmp_path_factory.mktemp("cab")
    port = free_port()
    with mortal_station(folder) as station, Browser(folder, SIZE) as browser:
        dashboard = start_dashboard(folder, station.endpoint, port, BENCH, DEMO)
        page = browser.open(f"http://127.0.0.1:{port}")
        made = Cab(folder, station, port, dashboard, page)
        try:
            yield made
        finally:
            made.dashboard.close()
        assert "Traceback" not in made.dashboard.err, made.dashboard.err


def test_scene_and_arm_appear_and_move_and_nothing_is_fetched_from_outside(cab: Cab) -> None:
    cab.page.wait("!!document.querySelector('.rg-banner')", 60.0)
    cab.station.calm()
    cab.monitored()
    assert "bench-excavator" in cab.page.text
    assert "slew-left: swing above +1.30 rad" in cab.page.text
    before = until(lambda: seen(cab.page), SOON_S, "a blue arm")
    cab.station.drive_to(0.9)
    until(lambda: moved(cab.page, before), SOON_S, "the arm elsewhere")

    hosts = {urlsplit(u).netloc for u in cab.page.requested if not u.startswith(("data:", "blob:"))}
    assert hosts == {f"127.0.0.1:{cab.port}"}
    assert not cab.page.complaints


def seen(page: Page) -> Scene | None:
    scene = Scene(page)
    return scene if scene.blue.sum() > LEAST_BLUE else None


def moved(page: Page, before: Scene) -> bool:
    """Some of what is blue now was not blue before: the foot stays, the rest turns."""
    now = Scene(page).blue
    return bool((now & ~before.blue).sum() > 0.03 * now.sum())


def test_an_alert_turns_banner_and_object_and_is_acknowledged_from_the_page(cab: Cab) -> None:
    page = cab.page
    # the swing before this came near the crate: what it raised must be over, and be drawn so
    page.wait("!document.querySelector('.rg-banner.rg-imminent')", SOON_S)
    until(lambda: Scene(page).red() < LEAST_RED, SOON_S, "a crate that is not red")
    start_s = time.monotonic()
    cab.station.press_on_crate()
    page.wait("!!document.querySelector('.rg-banner.rg-imminent.rg-flash')", SOON_S)
    assert "crate" in page.evaluate(BANNER)
    assert "IMMINENT" in page.evaluate(BANNER)
    assert "■" in page.evaluate(BANNER)
    until(lambda: Scene(page).red() > LEAST_RED, SOON_S, "a red crate")

    until(lambda: pressed(cab, start_s), SOON_S, "acknowledged by the page")
    page.wait("!document.querySelector('.rg-banner.rg-flash')", SOON_S)
    assert "crate: acknowledged by dashboard" in page.text
    cab.station.calm()
    page.wait("!document.querySelector('.rg-banner.rg-imminent')", SOON_S)


def pressed(cab: Cab, start_s: float) -> bool:
    """Press what may be pressed; whether the guard has told of it."""
    for alert in cab.station.ears.since(start_s, "alert"):
        if (alert.body["zone"], alert.body["acked_by"]) == ("crate", "dashboard"):
            return True
    with contextlib.suppress(AssertionError):  # nothing there to press at the moment
        cab.page.click("button", 0.2, text="Acknowledge")
    time.sleep(0.3)
    return False


def test_a_scene_that_is_put_is_drawn_without_a_reload(cab: Cab) -> None:
    page, base = cab.page, cab.station.site.keys.base
    own = Path(cab.station.site.scene.path).read_text("utf-8")
    fence = own.replace("slew-left", "fence").replace("above: 1.3", "above: 1.4")
    for text, shown in ((fence, "fence: swing above +1.40 rad"), (own, "slew-left: swing above")):
        wish = json.dumps({"scene": text, "who": "ann"}).encode()
        assert cab.station.ears.ask(f"{base}/scene/put", wish)
        page.wait(f"document.body.innerText.includes({json.dumps(shown)})", SOON_S)
    assert "fence" not in page.evaluate(BANNER)
    assert Scene(page).blue.sum() > LEAST_BLUE
    assert not page.complaints


def test_a_guard_that_dies_is_told_and_its_successor_is_taken_up_without_a_reload(
    cab: Cab,
) -> None:
    page = cab.page
    page.evaluate("window.sameAsBefore = true")
    processes.kill_guard(cab.station.guard)
    page.wait(LOST, SOON_S)
    cab.shows("NOT MONITORING")
    until(lambda: Scene(page).blue.sum() < LEAST_BLUE, SOON_S, "an arm without colour")
    cab.restart_guard()
    cab.station.calm()
    cab.monitored()
    assert page.evaluate("window.sameAsBefore === true")
    assert "the guard restarted" in page.text


@pytest.mark.parametrize("width", [1400, 1000])
def test_the_frame_cuts_nothing_and_notes_cover_no_words(cab: Cab, width: int) -> None:
    """There is room for the frame at any time: nothing moves when protection goes."""
    page = cab.page
    page.resize(width, 700)
    try:
        page.wait(f"{_FURTHEST} > 0 && {_FURTHEST} <= {width - 16}", SOON_S)
        assert page.evaluate(_OVERLAP) == 0.0
    finally:
        page.resize(*SIZE)


_FURTHEST = """Math.max(...[...document.querySelectorAll(
    '.rg-bars td, .rg-card, .rg-event, .rg-foot, .mantine-Button-root, .mantine-Input-input'
)].map(e => e.getBoundingClientRect().right))"""
"""Right end of what is in the panel [px]."""
_OVERLAP = """(() => {
    const legend = document.querySelector('.rg-legend');
    const before = legend.innerHTML;
    legend.innerHTML = '<span>in 5 of 8 similar situations you went on to here</span>'.repeat(3);
    const words = legend.getBoundingClientRect();
    legend.innerHTML = before;
    const notes = [...document.querySelectorAll('.mantine-Notifications-notification')];
    return Math.max(0, ...notes.map(note => words.right - note.getBoundingClientRect().left));
})()"""
"""By how much a note of viser's would cover a sentence at the left of the scene [px]."""


def test_each_page_chooses_its_machine(cab: Cab) -> None:
    choose(cab.page, "excavator-7")
    cab.page.wait(LOST, SOON_S)  # nobody guards that one
    cab.page.wait("document.body.innerText.includes('road-side: swing below -0.90 rad')", SOON_S)
    choose(cab.page, "bench-excavator")
    cab.monitored()


def choose(page: Page, machine: str) -> None:
    page.click("input.mantine-Select-input, .mantine-Select-input")
    page.wait(
        f"""(() => {{
            const all = [...document.querySelectorAll("[role='option']")];
            const one = all.find(o => o.innerText.startsWith({machine!r}) && o.offsetParent);
            if (!one) return false;
            one.click();
            return true;
        }})()""",
        SOON_S,
    )


def test_a_page_that_lost_its_dashboard_says_so_and_finds_it_again(cab: Cab) -> None:
    page = cab.page
    assert "lost its dashboard" not in page.text
    cab.dashboard.popen.kill()
    cab.dashboard.popen.wait()
    page.wait("document.body.innerText.includes('lost its dashboard')", SOON_S)
    cab.dashboard = start_dashboard(cab.folder, cab.station.endpoint, cab.port, BENCH, DEMO)
    page.wait("!document.body.innerText.includes('lost its dashboard')", SOON_S)
    cab.monitored()
    assert page.evaluate("window.sameAsBefore === true")


def test_a_name_that_is_not_its_own_leads_nowhere(cab: Cab) -> None:
    """DNS rebinding: the browser believes that it talks to evil.example."""
    for name, status in (("evil.example", 403), (f"localhost:{cab.port}", 200)):
        connection = http.client.HTTPConnection("127.0.0.1", cab.port, timeout=SOON_S)
        with contextlib.closing(connection):
            connection.request("GET", "/", headers={"Host": name})
            assert connection.getresponse().status == status


def test_a_second_one_on_the_same_port_is_refused(cab: Cab) -> None:
    args = ("dashboard", BENCH, "--connect", cab.station.endpoint, "--port", str(cab.port))
    done = processes.command(*args)
    assert done.returncode == 2
    assert f"cannot listen on 127.0.0.1 port {cab.port}" in done.stderr
    assert "Traceback" not in done.stderr


def test_sigterm_ends_it(cab: Cab) -> None:
    assert cab.dashboard.signal_and_wait(signal.SIGTERM) <= 5.0
    assert cab.dashboard.popen.returncode == 0, cab.dashboard.err
