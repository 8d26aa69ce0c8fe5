"""ROS bags: a folder of rosbag2 or one of its .db3 files, read as a recording is.

The topics of the site become its keys, and the time in the bag the arrival. An .mcap file of ROS 2
needs nothing of this: it is read as our own are, its topics known by their names
(`recording.channels.understood`). Definitions of types in a bag are never compiled.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from mcap.records import Channel

from rampe_guard.errors import LogError
from rampe_guard.recording.reader import Recorded
from rampe_guard.settings import Site
from rampe_guard.settings.ros2_keys import JOINT_STATE, JOY, Ros2Settings, RosType

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader

SQLITE: Final = b"SQLite format 3\0"


def is_bag(path: str | Path) -> bool:
    """Whether it is a folder of rosbag2, or a file of its sqlite3 storage."""
    path = Path(path)
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    with contextlib.suppress(OSError), path.open("rb") as file:
        return file.read(len(SQLITE)) == SQLITE
    return False


class BagReading:
    """A bag as `recording.reader.McapReading` has its files; see there for the attributes.

    Args:
        site: whose topics count.
        path: of the folder, or of a .db3 file.

    Raises:
        LogError: it cannot be read, holds nothing of the site, or something else on its topics.
    """

    def __init__(self, site: Site, path: str | Path) -> None:
        self.path = str(path)
        ros = _settings(site, self.path)
        self._wanted = {
            ros.joystick_topic: _channel(1, site.keys.joystick),
            ros.actuators_topic: _channel(2, site.keys.actuators),
        }
        kinds = {ros.joystick_topic: JOY, ros.actuators_topic: JOINT_STATE}
        self.warnings: tuple[str, ...] = ()
        self.metadata: dict[str, dict[str, str]] = {}
        self.counts: Counter[str] = Counter()
        with opened(self.path) as reader:
            self.first_ns, self.last_ns = reader.start_time, reader.end_time - 1
            for connection in reader.connections:
                self.counts[connection.topic] += connection.msgcount
            found = [c for c in reader.connections if c.topic in self._wanted and c.msgcount]
        for connection in found:
            _check_kind(self.path, connection, kinds[connection.topic])
        topics = {connection.topic for connection in found}
        self.channels = {c.id: c for topic, c in self._wanted.items() if topic in topics}
        if not self.counts.total():
            raise LogError(f"{self.path}: holds no message")

    def messages(self) -> Iterator[Recorded]:
        """All messages of the site's topics in the order in which they arrived."""
        last_ns = self.first_ns
        with opened(self.path) as reader:
            ours = [c for c in reader.connections if c.topic in self._wanted]
            for connection, at_ns, payload in guarded(self.path, reader, ours):
                if at_ns < last_ns:
                    raise LogError(
                        f"{self.path}: messages are not in order of time: {at_ns} ns follows"
                        f" {last_ns} ns; sort the bag first"
                    )
                last_ns = at_ns
                yield Recorded(at_ns, self._wanted[connection.topic], payload)

    def contents(self, _prefix: str) -> dict[str, bytes]:
        """Bags have no attachments."""
        return {}


@contextlib.contextmanager
def opened(path: str) -> Iterator[Reader]:
    """The library's reader of a bag (or of one of its files).

    Raises:
        LogError: it cannot be read, or the extra is not installed.
    """
    try:
        from rosbags.rosbag2 import Reader  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise LogError(
            f"{path}: ROS bags need rosbags ({error}): pip install 'rampe-guard[ros2]'"
        ) from None
    try:
        reader = Reader(path)
        reader.open()
    except Exception as error:  # noqa: BLE001 - whatever a damaged file makes of it
        raise LogError(f"{path}: cannot be read as a ROS bag: {_first_line(error)}") from None
    try:
        yield reader
    finally:
        reader.close()


def guarded(
    path: str, reader: Reader, connections: list[Connection]
) -> Iterator[tuple[Connection, int, bytes]]:
    """Messages of an open bag: on what, when it arrived [ns since 1970], and its bytes.

    Raises:
        LogError: the bag is damaged.
    """
    try:
        for connection, at_ns, payload in reader.messages(connections):
            yield connection, at_ns, bytes(payload)
    except Exception as error:  # noqa: BLE001 - the same
        raise LogError(f"{path}: is damaged: {_first_line(error)}") from None


def _channel(number: int, key: str) -> Channel:
    return Channel(id=number, message_encoding="cdr", metadata={}, schema_id=0, topic=key)


def _settings(site: Site, path: str) -> Ros2Settings:
    if site.ros2 is None:
        raise LogError(
            f"{path}: is a ROS bag, and {site.path} does not say which topics count; write"
            " format: ros2 and the topics under keys"
        )
    return site.ros2


def _check_kind(path: str, connection: Connection, kind: RosType) -> None:
    if connection.msgtype != kind.name:
        raise LogError(f"{path}: {connection.topic} is {connection.msgtype}, not {kind.name}")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:300]
