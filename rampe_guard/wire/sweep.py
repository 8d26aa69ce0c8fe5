"""Lines of ``rampe-guard sweep``: a motion in, a certificate out."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from rampe_guard.errors import MessageError
from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES, Message, decode
from rampe_guard.wire.inputs import MAX_VALUE


class SweepRequest(Message, frozen=True, kw_only=True):
    """A straight motion in actuator space."""

    start: Annotated[
        tuple[float, ...], Meta(description="Start position, in the site's order [rad or m].")
    ]
    displacement: Annotated[
        tuple[float, ...], Meta(description="The motion from there [rad or m].")
    ]
    any_path: Annotated[
        bool, Meta(description="Also ask whether any monotone way there could touch.")
    ] = True


class SweepReply(Message, frozen=True, kw_only=True):
    """What the sweep proved of the worst zone."""

    certificate: f.Certificate
    contact_fraction: f.Fraction
    link: f.Link
    zone: f.Zone
    contact_point_m: f.Point
    clearance_m: f.Clearance
    any_path: f.AnyPath
    witness: Annotated[
        tuple[float, ...] | None,
        Meta(
            description="With any_path possible: a position between start and end at which the arm"
            " touches [rad or m]; null where none is known."
        ),
    ] = None
    elapsed_ms: Annotated[float | None, Meta(description="Time of the sweep alone [ms].")] = None
    error: Annotated[
        str | None, Meta(description="Why no sweep was made; the certificate is unknown then.")
    ] = None


def decode_sweep_request(payload: bytes, actuators: int) -> SweepRequest:
    """A request with arrays of ``actuators`` finite values.

    Raises:
        MessageError: ``too_large``, ``bad_json``, ``not_finite`` or ``wrong_length``.
    """
    request = decode(payload, SweepRequest, limit=MAX_PAYLOAD_BYTES)
    for field, values in (("start", request.start), ("displacement", request.displacement)):
        if len(values) != actuators:
            raise MessageError(
                "wrong_length", f"{field} has {len(values)} values, the site has {actuators}"
            )
        for index, value in enumerate(values):
            if abs(value) > MAX_VALUE:
                raise MessageError("not_finite", f"{field}[{index}] is {value:g}: no such motion")
    return request
