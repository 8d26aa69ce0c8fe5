"""ROS 2 topics as Zenoh keys, of both bridges; strings only.

``rmw_zenoh``  ``<domain>/<topic>/<type>/<hash>``: ``0/joy/sensor_msgs::msg::dds_::Joy_/RIHS01_…``
``ros2dds``    the topic without its first slash, as zenoh-plugin-ros2dds routes it
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

Transport: TypeAlias = Literal["rmw_zenoh", "ros2dds"]

NO_HASH: Final = "TypeHashNotSupported"
"""What stands for the hash where ROS 2 knows none: in Humble."""
DIAGNOSTICS_TOPIC: Final = "/diagnostics"
"""Where everybody in ROS 2 says how he is."""
LIVELINESS: Final = "@ros2_lv"
"""The first part of the tokens by which rmw_zenoh tells who is there."""
MOST_DOMAIN: Final = 232
"""The highest ROS_DOMAIN_ID."""
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_DDS = "::dds_::"


@dataclass(frozen=True, slots=True)
class RosType:
    """A message type: its name as in ``sensor_msgs/msg/Joy``, and its REP-2011 hash.

    The hashes are the same from Humble to Lyrical.
    """

    name: str
    hash: str

    @property
    def dds(self) -> str:
        """As keys of rmw_zenoh name it."""
        package, _, name = self.name.split("/")
        return f"{package}::msg{_DDS}{name}_"


JOY: Final = RosType(
    "sensor_msgs/msg/Joy",
    "RIHS01_0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5",
)
JOINT_STATE: Final = RosType(
    "sensor_msgs/msg/JointState",
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
)
DIAGNOSTICS: Final = RosType(
    "diagnostic_msgs/msg/DiagnosticArray",
    "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
)
MARKERS: Final = RosType(
    "visualization_msgs/msg/MarkerArray",
    "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
)
STRING: Final = RosType(
    "std_msgs/msg/String",
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
)


@dataclass(frozen=True, slots=True)
class Ros2Settings:
    """How a site speaks ROS 2.

    Attributes:
        transport: what lies between ROS 2 and Zenoh.
        domain: ROS_DOMAIN_ID; in the keys of rmw_zenoh only.
        type_hash: keys of rmw_zenoh end with the hash of the type (all but Humble's).
        publish: diagnostics and markers are published.
        node: the guard's name in the ROS graph.
        frame: name of the world's frame in markers.
        joystick_topic: sensor_msgs/Joy.
        actuators_topic: sensor_msgs/JointState.
    """

    transport: Transport
    domain: int
    type_hash: bool
    publish: bool
    node: str
    frame: str
    joystick_topic: str
    actuators_topic: str

    @property
    def markers_topic(self) -> str:
        """Where the guard's markers are."""
        return f"/{self.node}/markers"

    @property
    def published(self) -> tuple[tuple[str, RosType], ...]:
        """Topics of the guard, each at the place that is its number in the ROS graph."""
        if not self.publish:
            return ()
        return (DIAGNOSTICS_TOPIC, DIAGNOSTICS), (self.markers_topic, MARKERS)

    def key(self, topic: str, kind: RosType) -> str:
        """The Zenoh key of a topic."""
        return key_of(topic, kind, self.transport, self.domain, type_hash=self.type_hash)


def key_of(topic: str, kind: RosType, transport: Transport, domain: int, *, type_hash: bool) -> str:
    """The Zenoh key of a topic (with its first slash)."""
    name = topic.removeprefix("/")
    if transport == "ros2dds":
        return name
    return f"{domain}/{name}/{kind.dds}/{kind.hash if type_hash else NO_HASH}"


def topic_of(key: str) -> str:
    """The topic that a key carries."""
    parts = key.split("/")
    return "/" + "/".join(parts[1:-2] if _is_rmw(parts) else parts)


def is_topic(text: str) -> bool:
    """Whether it can be a topic: a slash before every name, names of letters, digits and _."""
    return _TOPIC.fullmatch(text) is not None


def wrong_type(key: str, kind: RosType) -> str | None:
    """Why a whole key cannot carry a type, None if it can."""
    parts = key.split("/")
    if not _is_rmw(parts):
        return None
    if parts[-2] != kind.dds:
        return f"is of type {parts[-2]}, not {kind.dds}"
    if parts[-1] not in {kind.hash, NO_HASH}:
        return f"has not the hash of {kind.name}, {kind.hash}"
    return None


def strangers(key: str) -> str | None:
    """Where messages of the same topic with another type or hash lie; None: cannot be told."""
    parts = key.split("/")
    return "/".join([*parts[:-2], "*", "*"]) if _is_rmw(parts) else None


def why_strange(found: str, expected: str) -> tuple[str, str]:
    """A word, and a sentence, for a key that has the topic of another, but is not it."""
    theirs, ours = found.split("/")[-2:], expected.split("/")[-2:]
    if theirs[0] != ours[0]:
        return "wrong_type", f"somebody publishes {theirs[0]} there, not {ours[0]}"
    text = f"somebody's {ours[0]} has the hash {theirs[1]}, not {ours[1]}"
    humble = f"{text} (so does ROS 2 Humble: type_hash is false)"
    return "wrong_hash", humble if theirs[1] == NO_HASH else text


def in_words(key: str) -> str:
    """How a key would be told to ``ros2``: its topic and how it travels; any other as it is."""
    parts = key.split("/")
    if not _is_rmw(parts):
        return key
    return f"{topic_of(key)} of {parts[-2]} (rmw_zenoh, domain {parts[0]})"


def _is_rmw(parts: list[str]) -> bool:
    return len(parts) >= 4 and _DDS in parts[-2]  # noqa: PLR2004 - domain, topic, type, hash
