"""``rampe-guard dashboard``: machines in the browser."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Callable, Sequence

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import Site, load_site


def dashboard_sites(
    site_paths: Sequence[str],
    endpoints: Sequence[str],
    host: str,
    port: int,
    say: Callable[[str], None],
    stop: StopFlag,
) -> int:
    """Serve pages of these machines until told to stop; returns the exit code.

    Args:
        site_paths: a site file per machine.
        endpoints: instead of those of the site files.
        host: address to listen on.
        port: the same; 0 for any that is free.
        say: is told where the pages are.
        stop: ends it.

    Raises:
        SettingsError: the extra is not installed, or two site files are of one machine.
        ConnectionFailedError: the address cannot be listened on.
    """
    sites = [connect_to(load_site(path), endpoints) for path in site_paths]
    serve(sites, host, port, say, stop)
    return 0


def serve(
    sites: Sequence[Site],
    host: str,
    port: int,
    say: Callable[[str], None],
    stop: StopFlag,
) -> None:
    """The same for sites already read."""
    need_viser()
    bases = [site.keys.base for site in sites]
    twice = next((base for base in bases if bases.count(base) > 1), None)
    if twice is not None:
        raise SettingsError(f"two site files have keys.base {twice!r}; give each machine once")
    from rampe_guard.dashboard.feed import Feed  # noqa: PLC0415 - the extra is there by now
    from rampe_guard.dashboard.model import load_model  # noqa: PLC0415
    from rampe_guard.dashboard.server import Dashboard  # noqa: PLC0415

    models = stop.unless_stopped(lambda: [load_model(site) for site in sites])
    if models is None:
        return
    feeds = [Feed(site, stop) for site in sites]
    dashboard = Dashboard(models, feeds, host, port)
    with contextlib.ExitStack() as stack:
        stack.callback(dashboard.close)
        for feed in feeds:
            feed.start()
            stack.callback(feed.close)
        name = f"[{host}]" if ":" in host else host
        stack.callback(stop.set)  # first of all: what follows the machines waits for it
        say(f"dashboard on http://{name}:{dashboard.port}")
        dashboard.run(stop)


def need_viser() -> None:
    """See that the extra is installed.

    Raises:
        SettingsError: it is not.
    """
    if importlib.util.find_spec("viser") is None:
        raise SettingsError("the dashboard needs viser: pip install 'rampe-guard[dashboard]'")
