"""``{base}/forget``: what was learned of the operator is wiped."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message


class Forget(Message, frozen=True, kw_only=True):
    """Payload of a query on ``{base}/forget``; the answer tells what was forgotten.

    It concerns the operator who is at the levers by the guard's own account; another name is
    refused.
    """

    operator: Annotated[str, Meta(description="Of whom.", min_length=1, max_length=200)]
    who: Annotated[str, Meta(description="Who wants it so.", min_length=1, max_length=100)]


class Forgotten(Message, frozen=True, kw_only=True):
    """What a guard knew of its operator until now, and no longer does."""

    schema: Annotated[
        Literal["rampe.forgotten.v1"], Meta(description="Name and version of this contract.")
    ] = "rampe.forgotten.v1"
    site: f.Site
    machine: f.Machine
    operator: Annotated[str, Meta(description="Of whom.")]
    primitives: Annotated[int, Meta(description="How many primitives were known.", ge=0)]
    situations: Annotated[int, Meta(description="How many situations were remembered.", ge=0)]
