"""``rampe-guard record``: all that a machine and its guard say, in files that say what it is."""

from __future__ import annotations

import errno
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rampe_guard import __version__, wire
from rampe_guard.errors import LogError, MessageError, ModelFileError
from rampe_guard.recording.bundle import Bundle, gather
from rampe_guard.recording.channels import channels_of
from rampe_guard.recording.recorded_site import absolute_words
from rampe_guard.recording.recorder import Ended, Recorder
from rampe_guard.recording.scene_watch import SceneWatch
from rampe_guard.recording.series import Rotation, Series
from rampe_guard.recording.taps import Clock, Taps
from rampe_guard.recording.writer import FILES, METADATA, MODEL, SITUATIONS, Entry, Head
from rampe_guard.runtime.connecting import connect_to
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.runtime.store import ModelFile, model_path, situations_file
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import Site, for_operator, load_site

_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What a disk may say that will take files again some time."""
GUARD: Final = "rampe.guard"
FORMAT: Final = "1"


@dataclass(frozen=True, slots=True)
class Wishes:
    """What was asked for.

    Attributes:
        site: path of the site file.
        out: the first file.
        connect: endpoints instead of the site file's.
        operator: at the levers, instead of whom the site file names.
        rotate_mb: size of a file at which the next one begins [MB].
        rotate_minutes: age at which it does [min].
        seconds: for how long [s]; None: until stopped.
    """

    site: str
    out: str
    connect: Sequence[str]
    operator: str | None
    rotate_mb: float
    rotate_minutes: float
    seconds: float | None


def record(wishes: Wishes, stop: StopFlag) -> str:
    """Record until told to stop; returns one line on what there is.

    Raises:
        SettingsError: the site file is wrong.
        LogError: nothing can be written where it is wanted, or nothing ever was.
    """
    say = Sayer("rampe_guard.record")
    site = for_operator(connect_to(load_site(wishes.site), wishes.connect), wishes.operator)
    clock, channels = Clock(), channels_of(site)
    beginning = _Beginning(site, gather(site), clock, say)
    rotation = Rotation.of(wishes.rotate_mb, wishes.rotate_minutes)
    out = Path(wishes.out)
    if out.exists() and not out.is_file():
        raise LogError(f"{out}: is no file; give the name of one, such as day.mcap")
    series = Series(out, channels, beginning.head, rotation)
    _first_file(series, say)
    bus = Bus.open_retrying(site.zenoh, stop, lambda text: say.warn("connect", text), stop.wait)
    if bus is None:
        series.finish({"reason": "stopped"})
        return summary(Ended(0, 0, series.written_bytes), series.begun)
    with bus:
        taps = Taps(bus, channels, clock)
        beginning.scene.ask(bus)
        another = beginning.scene.changed
        recorder = Recorder(bus, site, taps, series, say, beginning.notice, another)
        say.info(f"recording {site.machine} at {site.name} into {wishes.out}")
        until_s = None if wishes.seconds is None else time.monotonic() + wishes.seconds

        def over() -> bool:
            return stop() or (until_s is not None and time.monotonic() >= until_s)

        ended = recorder.run(over, time.sleep)
    if ended.dropped and not ended.messages:
        raise LogError(f"nothing was recorded: {summary(ended, series.begun)}")
    return summary(ended, series.begun)


def summary(ended: Ended, files: Sequence[Path]) -> str:
    """One line on what there is."""
    where = ", ".join(map(str, files)) if len(files) <= 2 else f"{files[0]} … {files[-1]}"  # noqa: PLR2004
    count = "1 file" if len(files) == 1 else f"{len(files)} files"
    size = f"{ended.written_bytes / 1e6:.1f} MB"
    lost = f"{ended.dropped} messages LOST" if ended.dropped else "none lost"
    return f"{ended.messages} messages, {size} in {count} ({where or 'none'}), {lost}"


def _first_file(series: Series, say: Sayer) -> None:
    """Begin at once, so that a wrong path is told to who is still there to mend it."""
    try:
        series.open()
    except OSError as error:
        where = error.filename or "the recording"
        if error.errno not in _FULL:
            raise LogError(f"{where}: cannot be written: {error.strerror}") from None
        say.warn("degraded", f"degraded: {where}: {error.strerror}; trying again")


class _Beginning:
    """What stands at the beginning of each file; keeps an eye on what the guard really uses."""

    def __init__(self, site: Site, bundle: Bundle, clock: Clock, say: Sayer) -> None:
        self._site, self._clock, self._say = site, clock, say
        self.scene = SceneWatch(site, bundle, say)
        self._guard: dict[str, str] = {}

    def notice(self, entry: Entry) -> None:
        """Look whether the guard says that it works with the very files that are attached."""
        if entry.channel.role != "heartbeat":
            return
        try:
            beat = wire.decode(entry.payload, wire.Heartbeat)
        except MessageError:
            return
        self.scene.notice(beat.scene_hash)
        again = (beat.boot_id, beat.scene_hash) == (
            self._guard.get("boot_id"),
            self._guard.get("scene_hash"),
        )
        if again:
            return
        self._guard = {
            "boot_id": beat.boot_id,
            "version": beat.version,
            "config_hash": beat.config_hash,
            "scene_hash": beat.scene_hash,
        }
        if beat.config_hash != self._site.content_hash:
            text = f"the guard works with another site file or URDF than {self._site.path}: what is"
            self._say.warn("config", f"{text} attached to the recording is not what it saw")

    def head(self, number: int) -> Head:
        """The beginning of the file of this number."""
        site, bundle = self.scene.site, self.scene.bundle
        words = {
            "format": FORMAT,
            "version": __version__,
            "site_file": FILES + bundle.site,
            "absolute": absolute_words(bundle),
            "site": site.name,
            "machine": site.machine,
            "operator": site.operator,
            "config_hash": site.content_hash,
            "scene_hash": site.scene.content_hash,
            "number": str(number),
        }
        attachments = {FILES + name: content for name, content in bundle.files.items()}
        attachments |= self._learned()
        guard = {GUARD: self._guard} if self._guard else {}
        return Head({METADATA: words, **guard}, attachments, self._clock.now_ns())

    def _learned(self) -> dict[str, bytes]:
        """What is kept of the operator now, if anything."""
        if not self._site.memory.enabled:
            return {}
        found = {}
        try:
            path = model_path(self._site)
            for prefix, file in ((MODEL, ModelFile(path)), (SITUATIONS, situations_file(path))):
                content = file.read()
                if content is not None:
                    found[prefix + file.path.name] = content
        except ModelFileError as error:
            self._say.warn("model", f"what was learned is not attached: {error}")
        return found
