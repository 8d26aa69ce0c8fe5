"""Liveliness tokens by which ROS 2 sees a node and its publishers (rmw_zenoh's graph).

::

    @ros2_lv/<domain>/<zid>/<node>/<entity>/NN/<enclave>/<namespace>/<name>
    @ros2_lv/<domain>/<zid>/<node>/<entity>/MP/<enclave>/<namespace>/<name>
                                              /<topic>/<type>/<hash>/<qos>

Slashes inside of a part are written %, and what is empty is %, too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from rampe_guard.settings.ros2_keys import (
    LIVELINESS,
    NO_HASH,
    Ros2Settings,
    RosType,
    strangers,
    topic_of,
)

_NODE_ID: Final = 0
_FIRST_ENTITY: Final = 10
"""rmw_zenoh gives entities of one session different numbers; which does not matter."""
_DEPTH: Final = 10


@dataclass(frozen=True, slots=True)
class Voice:
    """The guard's node in the ROS graph: tokens of its own and of its publishers.

    Attributes:
        settings: domain and name.
        zid: of the Zenoh session; ``*`` makes key expressions for that of any.
    """

    settings: Ros2Settings
    zid: str

    @property
    def node(self) -> str:
        """The token of the node."""
        return f"{self._session}/{_NODE_ID}/{_NODE_ID}/NN/%/%/{self.settings.node}"

    def publisher(self, number: int, topic: str, kind: RosType) -> str:
        """The token of one publisher (reliable, volatile, the last 10 messages)."""
        ros = self.settings
        return "/".join(
            (
                f"{self._session}/{_NODE_ID}/{_FIRST_ENTITY + number}/MP/%/%/{ros.node}",
                topic.replace("/", "%"),
                kind.dds,
                kind.hash if ros.type_hash else NO_HASH,
                f"::,{_DEPTH}:,:,:,,",
            )
        )

    @property
    def tokens(self) -> tuple[str, ...]:
        """All tokens of the guard: its node, and what that publishes."""
        said = enumerate(self.settings.published)
        return (self.node, *(self.publisher(at, topic, kind) for at, (topic, kind) in said))

    @property
    def _session(self) -> str:
        return f"{LIVELINESS}/{self.settings.domain}/{self.zid}"


def driver_tokens(node: str, keys: Iterable[str]) -> tuple[str, ...]:
    """Key expressions of the tokens of another node, and of its publishers on keys of rmw_zenoh.

    Open are session, numbers, enclave and QoS, all of which the node chooses when it starts.

    Args:
        node: its full name, as in ``/arm/joy_node``.
        keys: that it publishes on; those of no topic have no token.
    """
    namespace, _, name = node.rpartition("/")
    who = f"{namespace.replace('/', '%') or '%'}/{name}"
    found: dict[str, None] = {}  # each once, in their order
    for key in keys:
        if strangers(key) is not None:
            any_of = f"{LIVELINESS}/{key.split('/')[0]}/*/*/*"
            kind = "/".join(key.split("/")[-2:])
            found[f"{any_of}/NN/*/{who}"] = None
            found[f"{any_of}/MP/*/{who}/{topic_of(key).replace('/', '%')}/{kind}/*"] = None
    return tuple(found)


def gid_of(token: str) -> bytes:
    """16 bytes that name a publisher, made of its token; another hash than rmw_zenoh's own."""
    return hashlib.blake2b(token.encode(), digest_size=16).digest()
