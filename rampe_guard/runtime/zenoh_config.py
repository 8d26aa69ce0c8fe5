"""What a site says of its session, as parts of Zenoh's configuration: path and JSON text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Literal

from rampe_guard.runtime.certificates import check_files
from rampe_guard.settings import ZenohSettings
from rampe_guard.settings.network import PROVEN, protocol

_TRY_MS = 1000
"""One attempt to connect; longer ones cannot be interrupted by a signal."""
_QUEUE = 16
"""Messages that may wait for a link, of each priority: Zenoh's most. Its default of 2 drops alerts
of a third zone in the same step when the sending thread is late by a millisecond."""

Part = tuple[str, str]


def parts(settings: ZenohSettings) -> Iterator[Part]:
    """To be put into Zenoh's defaults, or into the configuration file that the site names.

    Raises:
        SettingsError: a certificate cannot be used.
    """
    if settings.config is None:
        yield from blank(settings.mode)
        yield "connect/endpoints", json.dumps(list(settings.connect))
        files = settings.tls
        if files is not None and any(protocol(end) in PROVEN for end in settings.connect):
            check_files(files)
            tls = {
                "root_ca_certificate": files.root_ca,
                "verify_name_on_connect": True,
                "enable_mtls": files.key is not None,
                "connect_certificate": files.certificate,
                "connect_private_key": files.key,
            }
            yield "transport/link/tls", json.dumps(tls)
    yield "connect/timeout_ms", str(_TRY_MS)
    yield "connect/exit_on_failure", "true"
    retry = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2}
    yield "connect/retry", json.dumps(retry)


def blank(mode: Literal["client", "peer", "router"]) -> Iterator[Part]:
    """A session that listens nowhere and finds nobody by itself."""
    yield "mode", json.dumps(mode)
    yield "listen/endpoints", "[]"
    yield "scouting/multicast/enabled", "false"
    yield "scouting/gossip/enabled", "false"
    for priority in ("real_time", "data"):
        yield f"transport/link/tx/queue/size/{priority}", str(_QUEUE)
