"""Zenoh as ROS 2 uses it: CDR with attachments, and publishers that keep their last message."""

from __future__ import annotations

import time

import zenoh
import zenoh.ext

_LOOK_S = 0.02


class CdrOutbox:
    """A publisher of CDR on one key; ``put`` never waits for a slow subscriber."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._publisher = session.declare_publisher(
            key,
            encoding=zenoh.Encoding.APPLICATION_CDR,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
        )

    def put(self, payload: bytes, attachment: bytes | None) -> None:
        """Send; lost silently while no router is there."""
        self._publisher.put(payload, attachment=attachment)


def latched(session: zenoh.Session, key: str, timeout_s: float) -> bytes | None:
    """The newest message of a publisher that keeps it (durability transient local).

    Both rmw_zenoh and zenoh-plugin-ros2dds keep it in the cache of an advanced publisher, which
    an advanced subscriber asks when it begins. None if none came within ``timeout_s``.
    """
    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        zenoh.handlers.RingChannel(1),
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
    )
    try:
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            if (sample := subscriber.try_recv()) is not None:
                return bytes(sample.payload.to_bytes())
            time.sleep(_LOOK_S)
    finally:
        subscriber.undeclare()
    return None
