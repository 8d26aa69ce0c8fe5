"""Liveliness tokens by which ROS 2 sees a node and its publishers (rmw_zenoh's graph).

::

    @ros2_lv/<domain>/<zid>/<node>/<entity>/NN/<enclave>/<namespace>/<name>
    @ros2_lv/<domain>/<zid>/<node>/<entity>/MP/<enclave>/<namespace>/<name>
                                              /<topic>/<type>/<hash>/<qos>

Slashes inside of a part are written %, and what is empty is %, too.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Final

from rampe_guard.settings.ros2_keys import NO_HASH, Ros2Settings, RosType

_NODE_ID: Final = 0
_FIRST_ENTITY: Final = 10
"""rmw_zenoh gives entities of one session different numbers; which does not matter."""
_DEPTH: Final = 10


@dataclass(frozen=True, slots=True)
class Voice:
    """The guard's node in the ROS graph: tokens of its own and of its publishers.

    Attributes:
        settings: domain and name.
        zid: of the Zenoh session.
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
    def _session(self) -> str:
        return f"@ros2_lv/{self.settings.domain}/{self.zid}"


def gid_of(token: str) -> bytes:
    """16 bytes that name a publisher, made of its token; another hash than rmw_zenoh's own."""
    return hashlib.blake2b(token.encode(), digest_size=16).digest()
