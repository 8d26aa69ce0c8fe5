"""What a guard publishes."""

from __future__ import annotations

PUBLISHED = (
    *("alert", "prediction", "advice", "heartbeat", "state", "scene", "scene/put", "ack", "shelve"),
    *("forget", "alive", "recorder"),
)
"""What the guard publishes or answers under its base key."""
