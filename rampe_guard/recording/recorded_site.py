"""The site of a recording, from its attachments: no other file is needed."""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec

from rampe_guard import wire
from rampe_guard.errors import LogError, MessageError
from rampe_guard.recording.bag import BagReading
from rampe_guard.recording.bundle import Bundle, unpack
from rampe_guard.recording.channels import role_of
from rampe_guard.recording.reader import McapReading
from rampe_guard.recording.writer import FILES, METADATA, MODEL, SITUATIONS
from rampe_guard.settings import Site, for_operator, load_site


@contextlib.contextmanager
def recorded_site(reading: McapReading) -> Iterator[Site]:
    """The site as it was recorded, its files in a folder that goes when the context ends.

    Raises:
        LogError: the file has no such attachments, or not all of them.
        SettingsError: they are not what this version takes.
    """
    words = reading.metadata.get(METADATA)
    if words is None or not words.get("site_file", "").startswith(FILES):
        raise LogError(
            f"{reading.path}: has no site file in it: rampe-guard did not record it, or its"
            f" beginning is damaged. Name one: rampe-guard replay SITE {reading.path}"
        )
    try:
        absolute = msgspec.json.decode(words.get("absolute", "{}"), type=dict[str, str])
    except msgspec.DecodeError as error:
        raise LogError(f"{reading.path}: metadata {METADATA}: absolute: {error}") from None
    bundle = Bundle(words["site_file"].removeprefix(FILES), reading.contents(FILES), absolute)
    with tempfile.TemporaryDirectory(prefix="rampe-guard-replay-") as folder:
        try:
            path = unpack(bundle, Path(folder))
        except LogError as error:
            raise LogError(f"{reading.path}: {error}") from None
        yield for_operator(load_site(path, within=folder), words.get("operator"))


def learned_before(reading: McapReading | BagReading) -> bytes | None:
    """The model that was kept when the recording began; None if none was."""
    return next(iter(reading.contents(MODEL).values()), None)


def remembered_before(reading: McapReading | BagReading) -> bytes | None:
    """The situations that were kept when the recording began; None if none were."""
    return next(iter(reading.contents(SITUATIONS).values()), None)


def other_files(reading: McapReading) -> tuple[str, ...]:
    """What the recorded guard itself says that it read otherwise than it is attached."""
    words = reading.metadata.get(METADATA, {})
    for message in reading.messages():
        if role_of(message.channel.metadata) != "heartbeat":
            continue
        with contextlib.suppress(MessageError):
            beat = wire.decode(message.payload, wire.Heartbeat)
            theirs = {"config_hash": beat.config_hash, "scene_hash": beat.scene_hash}
            names = {"config_hash": "site file or URDF", "scene_hash": "scene"}
            return tuple(names[key] for key, said in theirs.items() if words.get(key) != said)
    return ()


def absolute_words(bundle: Bundle) -> str:
    """`Bundle.absolute` as a word of metadata."""
    return json.dumps(dict(bundle.absolute))
