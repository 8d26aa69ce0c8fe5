"""CDR bytes ↔ messages, by rosbags; nothing malformed gets further than here.

Types are the library's own: definitions that come with a bag are never compiled.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rampe_guard.errors import MessageError, SettingsError
from rampe_guard.settings.ros2_keys import RosType
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

_PLAIN = (b"\x00\x00", b"\x00\x01")
"""Plain CDR, big- and little-endian: all that ROS 2 sends."""


@cache
def store() -> Typestore:
    """The types of ROS 2.

    Raises:
        SettingsError: the extra is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise SettingsError(
            f"ROS 2 messages need rosbags ({error}): pip install 'rampe-guard[ros2]'"
        ) from None
    return get_typestore(Stores.ROS2_JAZZY)


def decode(payload: bytes, kind: RosType, limit: int = MAX_PAYLOAD_BYTES) -> Any:
    """The message that ``payload`` holds, as the library's object of that type.

    No sequence or text can be longer than the bytes that there are, so ``limit`` bounds what is
    allocated.

    Raises:
        MessageError: ``too_large`` or ``bad_cdr``.
    """
    if len(payload) > limit:
        raise MessageError("too_large", f"{len(payload)} bytes, at most {limit} are taken")
    if payload[:2] not in _PLAIN or len(payload) < 4:  # noqa: PLR2004 - the header
        raise MessageError("bad_cdr", f"does not begin as CDR does: {payload[:4].hex()}")
    try:
        return store().deserialize_cdr(payload, kind.name)
    except Exception as error:  # noqa: BLE001 - the reader raises whatever it likes
        raise MessageError("bad_cdr", f"no {kind.name}: {str(error)[:200]}") from None


def encode(message: object, kind: RosType) -> bytes:
    """The bytes of one of the library's objects, little-endian as ROS 2 writes them."""
    return bytes(store().serialize_cdr(message, kind.name, little_endian=True))


def make(kind: str, /, **fields: Any) -> Any:
    """A message of a type such as ``std_msgs/msg/Header``; all fields are given."""
    return store().types[kind](**fields)


def header(stamp_s: float, frame: str) -> Any:
    """A std_msgs/Header at a time [s since 1970]."""
    return make("std_msgs/msg/Header", stamp=time_of(stamp_s), frame_id=frame)


def time_of(stamp_s: float) -> Any:
    """A builtin_interfaces/Time of seconds since 1970."""
    nanoseconds = round(stamp_s * 1e9)
    seconds, rest = divmod(nanoseconds, 10**9)
    return make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
