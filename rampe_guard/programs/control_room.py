"""``rampe-guard watch`` of many machines, or as JSON lines; needs no meshes."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from rich.console import Console

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import Site, ZenohSettings, load_site
from rampe_guard.view.links import Link
from rampe_guard.view.wall import Wall
from rampe_guard.view.wall_watch import watch_json, watch_wall


def watch_many(
    site_paths: Sequence[str],
    bases: Sequence[str],
    network: Network,
    console: Console,
    stop: StopFlag,
    *,
    bell: bool,
    as_json: bool,
) -> int:
    """Show machines until told to stop; waits for routers and guards that are not there yet.

    Args:
        site_paths: site files.
        bases: key expressions of prefixes of guards, beside the sites'.
        network: how to join, instead of as the site files say.
        console: where to.
        stop: ends it.
        bell: ring the terminal's bell.
        as_json: print JSON lines instead.

    Raises:
        SettingsError: a site file, an endpoint or a key expression is not valid.
    """
    if not site_paths and not bases:
        raise SettingsError("nothing to watch: name a site file, or --base 'rampe/*/*/guard'")
    if bell and (as_json or not console.is_terminal):
        raise SettingsError("--bell rings a terminal's bell, and the output is no terminal")
    sites = [network.of(load_site(path)) for path in site_paths]
    names = {site.keys.base: (site.machine, site.name) for site in sites}
    with contextlib.ExitStack() as stack:
        links = [stack.enter_context(link) for link in _links(sites, bases, network)]
        if as_json:
            watch_json(links, stop)
        else:
            asked = (*names, *bases)
            watch_wall(links, Wall(0.0, names=names, asked=asked), stop, console, bell=bell)
    return 0


def _links(sites: Sequence[Site], bases: Sequence[str], network: Network) -> list[Link]:
    """One for each way to join a network."""
    ways: dict[ZenohSettings, list[str]] = {}
    for site in sites:
        ways.setdefault(site.zenoh, []).append(site.keys.base)
    if bases:
        # beside site files their own network is meant
        known = list(ways) if not network.said else []
        for way in known or [network.settings]:
            ways.setdefault(way, []).extend(bases)
    return [Link(way, list(dict.fromkeys(wanted))) for way, wanted in ways.items()]
