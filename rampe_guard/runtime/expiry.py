"""Tells in time that the certificate of the session runs out: nobody can join with one that has."""

from __future__ import annotations

import time
from typing import Final

from rampe_guard import wire
from rampe_guard.runtime.certificates import DAY_S, check_files
from rampe_guard.settings import ZenohSettings
from rampe_guard.settings.network import PROVEN, protocol

WARN_DAYS: Final = 14.0


class Expiry:
    """When the certificates of a site file end: those that this session was opened with.

    A certificate that was renewed on the disk is used, and known here, from the next start on.
    Those in a Zenoh configuration file are not looked at.

    Args:
        settings: of the session, which is open.
    """

    def __init__(self, settings: ZenohSettings, now_unix_s: float | None = None) -> None:
        now = time.time() if now_unix_s is None else now_unix_s
        self._ends_unix_s = float("inf")
        used = settings.config is None and any(protocol(e) in PROVEN for e in settings.connect)
        if settings.tls is not None and used:
            self._ends_unix_s = now + check_files(settings.tls, now) * DAY_S

    def reasons(self, now_unix_s: float) -> tuple[wire.Reason, ...]:
        """Why the guard is degraded, if it is."""
        days = (self._ends_unix_s - now_unix_s) / DAY_S
        if days >= WARN_DAYS:
            return ()
        date = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(self._ends_unix_s))
        when = f"ends in {days:.1f} days" if days > 0.0 else "has ended"
        text = f"the certificate for Zenoh {when} ({date}); renew it and start the guard anew"
        return (wire.Reason(code="certificate_expiring", text=text, key=None),)
