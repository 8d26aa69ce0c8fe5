"""``{base}/ack``: someone has seen an alert."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from rampe_guard.wire.codec import Message


class Ack(Message, frozen=True, kw_only=True):
    """Payload of a query on ``{base}/ack``; the answer is the alert, or an error text."""

    alert_id: Annotated[str, Meta(description="The alert that was seen.", max_length=200)]
    who: Annotated[str, Meta(description="Who has seen it.", min_length=1, max_length=100)]
