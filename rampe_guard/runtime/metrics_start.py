"""Whether and where a guard serves its metrics; the extra is only needed where it does."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TypeAlias

from rampe_guard import wire
from rampe_guard.errors import SettingsError
from rampe_guard.runtime.health import Pulse
from rampe_guard.runtime.say import Sayer
from rampe_guard.settings import MetricsSettings
from rampe_guard.settings.network import is_loopback

Show: TypeAlias = Callable[[wire.Heartbeat, Pulse, float], None]
"""Takes a heartbeat, the durations behind it, and when it was made [s]; never waits."""


@contextlib.contextmanager
def served(where: MetricsSettings | None, say: Sayer, *, again: bool) -> Iterator[Show | None]:
    """Serve metrics on a host and port, if there is one.

    Args:
        where: host and TCP port; None serves nothing.
        say: log.
        again: the guard was started anew after a crash; then it guards even without metrics.

    Raises:
        SettingsError: it cannot listen there, or the extra is not installed.
    """
    with contextlib.ExitStack() as stack:
        show: Show | None = None
        if where is not None:
            try:
                show = _serve(where.host, where.port, say, stack)
            except SettingsError as error:
                if not again:
                    raise
                say.warn("metrics", str(error))
        yield show


def _serve(host: str, port: int, say: Sayer, stack: contextlib.ExitStack) -> Show:
    from rampe_guard.runtime.metrics import Metrics  # noqa: PLC0415 - needs the extra
    from rampe_guard.runtime.metrics_server import MetricsServer  # noqa: PLC0415 - the same

    metrics = Metrics()
    server = stack.enter_context(MetricsServer(metrics, host, port))
    name = f"[{host}]" if ":" in host else host
    url = f"http://{name}:{server.port}/metrics"
    warning = "" if is_loopback(host) else ", to everyone who reaches this computer"
    say.info(f"metrics on {url}{warning}", url=url)
    return metrics.show
