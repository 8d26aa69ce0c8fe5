"""``rampe-guard sweep``: motions as JSON lines in, certificates as JSON lines out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from rampe_guard import wire
from rampe_guard.core.types import Certificate
from rampe_guard.errors import MessageError
from rampe_guard.runtime.loading import load_telling
from rampe_guard.settings import load_site

_OUT_OF_REACH = (
    "start or way leaves the range in which the drives are proven, or the budget was spent"
)


def sweep_lines(site_path: str, lines: Iterable[bytes]) -> Iterator[bytes]:
    """One reply a line; a line that is no motion gets the certificate ``unknown`` and a reason."""
    site = load_site(site_path)
    sweeper = load_telling(site).sweeper
    n = len(site.actuator_names)
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            request = wire.decode_sweep_request(line, n)
        except MessageError as error:
            yield wire.encode(_unknown(f"line {number}: {error}"))
            continue
        start, displacement = np.array(request.start), np.array(request.displacement)
        result = sweeper.sweep(start, displacement, any_path=request.any_path, worst=True)
        yield wire.encode(
            wire.SweepReply(
                certificate=result.certificate.value,
                contact_fraction=result.contact_fraction,
                link=result.link,
                zone=result.zone,
                contact_point_m=result.contact_point_m,
                clearance_m=result.clearance_m,
                any_path=None if result.any_path is None else result.any_path.value,
                witness=result.witness,
                elapsed_ms=result.elapsed_ms,
                error=_OUT_OF_REACH if result.certificate is Certificate.UNKNOWN else None,
            )
        )


def _unknown(error: str) -> wire.SweepReply:
    return wire.SweepReply(
        certificate="unknown",
        contact_fraction=None,
        link=None,
        zone=None,
        contact_point_m=None,
        clearance_m=None,
        any_path="unknown",
        elapsed_ms=None,
        error=error,
    )
