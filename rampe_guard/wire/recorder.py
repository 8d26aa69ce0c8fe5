"""``{base}/recorder``: that a recorder runs beside the guard, and whether it loses anything."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

SCHEMA: Final = "rampe.recorder.v1"


class Recorder(Message, frozen=True, kw_only=True):
    """What a recorder does, sent by itself once a second; it says nothing of protection."""

    schema: Annotated[
        Literal["rampe.recorder.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    site: f.Site
    machine: f.Machine
    status: Annotated[
        Literal["recording", "degraded"],
        Meta(description="degraded: something is not written now, or was lost within 5 s."),
    ]
    reason: Annotated[
        str | None, Meta(description="Why degraded, for people; null while recording.")
    ]
    file: Annotated[
        str | None, Meta(description="Name of the file that is written; null: none can be.")
    ]
    files: Annotated[int, Meta(description="Files begun since the recorder started.")]
    messages: Annotated[int, Meta(description="Messages safely on the disk, in all files.")]
    written_bytes: Annotated[int, Meta(description="Size of all files together [bytes].")]
    waiting: Annotated[int, Meta(description="Messages that wait to be written.")]
    dropped: Annotated[int, Meta(description="Messages lost since the recorder started.")]
    version: Annotated[str, Meta(description="Version of rampe-guard.")]
    published_unix_s: f.Published
