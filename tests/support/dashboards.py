"""``rampe-guard dashboard`` as a process, and what is asked of its pages."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path

from rampe_guard.settings import load_site
from tests.support import processes
from tests.support.browser import Page
from tests.support.ears import Ears
from tests.support.processes import BENCH, Process, started
from tests.support.rig import Rig
from tests.support.station import REST, Station

BANNER = "document.querySelector('.rg-banner').innerText"
LOST = "!!document.querySelector('.rg-banner.rg-lost')"
_NOTE = """
window.noted = [];
window.noteBanner = () => {
    const banner = document.querySelector('.rg-banner');
    const tone = banner ? banner.className : '';
    const last = window.noted.at(-1);
    if (!last || last[1] !== tone) window.noted.push([Date.now() / 1000, tone]);
};
window.beats = [];
window.noteBeat = () => {
    const gone = document.querySelector('.rg-gone');
    const count = gone ? gone.dataset.count : '';
    const last = window.beats.at(-1);
    if (count && (!last || last[1] !== count)) window.beats.push([Date.now() / 1000, count]);
};
new MutationObserver(() => { window.noteBanner(); window.noteBeat(); })
    .observe(document.body, {subtree: true, childList: true, attributes: true});
window.noteBanner();
true
"""


def free_port() -> int:
    """A port of loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def start_dashboard(folder: Path, endpoint: str, port: int, *sites: Path) -> Process:
    """A dashboard that serves when this returns."""
    args = ["-m", "rampe_guard", "dashboard", *map(str, sites), "--connect", endpoint]
    process = Process(folder, "dashboard", [*args, "--port", str(port)])
    return started(process, "dashboard on", 60.0)


@contextlib.contextmanager
def mortal_station(folder: Path) -> Iterator[Station]:
    """A `station` whose guard may be killed and replaced: whichever it has is ended."""
    site, endpoint = load_site(BENCH), processes.free_endpoint()
    with (
        processes.router(folder, endpoint) as router,
        Ears(endpoint, site.keys.base) as ears,
        Rig(endpoint, site, REST) as rig,
    ):
        guard = processes.guard(folder, BENCH, endpoint)
        made = Station(site, BENCH, endpoint, router, guard, rig, ears)
        try:
            yield made
        finally:
            made.guard.close()


def replace_guard(folder: Path, made: Station) -> None:
    """Another guard, once the one before is no more."""
    made.guard = processes.guard(folder, BENCH, made.endpoint)


def note_changes(page: Page) -> None:
    """Let the page note when its banner changed its tone, and when it was told that all lives."""
    page.wait("!!document.querySelector('.rg-banner')", 60.0)
    page.evaluate(_NOTE)


def tones(page: Page) -> list[tuple[float, str]]:
    """Unix times [s] at which the banner got these style classes."""
    return [(at_s, name) for at_s, name in page.evaluate("window.noted")]


def beats(page: Page) -> list[float]:
    """Unix times [s] at which the page was told that its dashboard lives."""
    return [at_s for at_s, _ in page.evaluate("window.beats")]
