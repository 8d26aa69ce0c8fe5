"""``rampe-guard dashboard``: machines in the browser."""

from __future__ import annotations

import contextlib
import importlib.util
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.zenoh_io import check_configuration
from rampe_guard.settings import Site, load_site
from rampe_guard.settings.network import is_loopback


@dataclass(frozen=True, slots=True)
class Place:
    """Where a dashboard listens, and who may come.

    Attributes:
        host: address.
        port: 0 for any that is free.
        token_file: holds the token; without it one is made beyond loopback.
        names: further names by which browsers may call it.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token_file: str | None = None
    names: tuple[str, ...] = ()

    def token(self) -> str | None:
        """What pages have to show; None on loopback, unless a file gives one.

        Raises:
            SettingsError: the file cannot be read, others may read it, or its token is too weak.
        """
        from rampe_guard.dashboard.access import wrong_token  # noqa: PLC0415

        if self.token_file is None:
            return None if is_loopback(self.host) else secrets.token_urlsafe(24)
        token = read_secret(self.token_file)
        if reason := wrong_token(token):
            how = "python3 -c 'import secrets; print(secrets.token_urlsafe(24))'"
            raise SettingsError(f"{self.token_file}: its token {reason}; make one: {how}")
        return token


def dashboard_sites(
    site_paths: Sequence[str],
    endpoints: Sequence[str],
    place: Place,
    say: Callable[[str], None],
    stop: StopFlag,
) -> int:
    """Serve pages of these machines until told to stop; returns the exit code.

    Args:
        site_paths: a site file per machine.
        endpoints: instead of those of the site files.
        place: where it listens.
        say: is told where the pages are.
        stop: ends it.

    Raises:
        SettingsError: the extra is not installed, two site files are of one machine, or an
            endpoint or the token cannot be used.
        ConnectionFailedError: the address cannot be listened on.
    """
    sites = [connect_to(load_site(path), endpoints) for path in site_paths]
    serve(sites, place, say, stop)
    return 0


def serve(
    sites: Sequence[Site],
    place: Place,
    say: Callable[[str], None],
    stop: StopFlag,
) -> None:
    """The same for sites already read."""
    need_viser()
    token = place.token()
    for site in sites:
        check_configuration(site.zenoh)
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
    dashboard = Dashboard(models, feeds, place.host, place.port, token, place.names)
    with contextlib.ExitStack() as stack:
        stack.callback(dashboard.close)
        for feed in feeds:
            feed.start()
            stack.callback(feed.close)
        name = f"[{place.host}]" if ":" in place.host else place.host
        stack.callback(stop.set)  # first of all: what follows the machines waits for it
        shown = f"/?token={token}" if token is not None and place.token_file is None else ""
        say(f"dashboard on http://{name}:{dashboard.port}{shown}")
        if place.token_file is not None:
            say(f"open it once with ?token=… from {place.token_file}")
        dashboard.run(stop)


def read_secret(path: str) -> str:
    """The first line of a file that only its owner may read.

    Raises:
        SettingsError: it cannot be read, or others may.
    """
    try:
        mode = Path(path).stat().st_mode & 0o777
        with Path(path).open(encoding="ascii", errors="replace") as file:
            text = file.read(4096)
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read ({error.strerror})") from None
    if mode & 0o077:
        raise SettingsError(
            f"{path}: others than its owner may use this file (mode {mode:04o}); chmod 600 {path}"
        )
    return text.partition("\n")[0].strip()


def need_viser() -> None:
    """See that the extra is installed.

    Raises:
        SettingsError: it is not.
    """
    if importlib.util.find_spec("viser") is None:
        raise SettingsError("the dashboard needs viser: pip install 'rampe-guard[dashboard]'")
