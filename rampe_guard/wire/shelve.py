"""``{base}/shelve``: someone wants an alert to be silent for a while."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from rampe_guard.wire.codec import Message


class Shelve(Message, frozen=True, kw_only=True):
    """Payload of a query on ``{base}/shelve``; the answer is the alert, or an error text.

    The guard refuses more than its site's ``alerts.shelve_max_s`` (30 s at the most), and to
    shelve an alert that is imminent.
    """

    alert_id: Annotated[str, Meta(description="The alert to be silent.", max_length=200)]
    who: Annotated[str, Meta(description="Who wants it so.", min_length=1, max_length=100)]
    duration_s: Annotated[float, Meta(description="For how long, from now [s]; 0 ends it.", ge=0.0)]
