"""``{base}/scene`` and ``{base}/scene/put``: the keep-out scene in force, and another one."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.codec import Message

MAX_SCENE_BYTES: Final = 4 * 1024 * 1024
"""Largest payload on ``{base}/scene/put``: a scene file has at most 1 MB, and JSON escapes."""


class ScenePut(Message, frozen=True, kw_only=True):
    """Payload of a query on ``{base}/scene/put``; the answer is the scene then in force.

    The scene takes effect when it is wholly built, between two steps. A wrong one is refused with
    its errors, and the old one stays.
    """

    scene: Annotated[
        str, Meta(description="The text of a scene file; meshes as seen from the site's own.")
    ]
    who: Annotated[str, Meta(description="Who puts it.", min_length=1, max_length=100)]


class SceneInForce(Message, frozen=True, kw_only=True):
    """The scene against which a guard sweeps: answer on ``{base}/scene`` and its ``/put``."""

    schema: Annotated[
        Literal["rampe.scene.v1"], Meta(description="Name and version of this contract.")
    ] = "rampe.scene.v1"
    site: f.Site
    machine: f.Machine
    scene_hash: Annotated[
        str, Meta(description="SHA-256 of its text and meshes, as in heartbeats.")
    ]
    scene: Annotated[str | None, Meta(description="Its text; null in the answer to a put.")]
    zones: Annotated[tuple[str, ...], Meta(description="All zones, those of the arm itself too.")]
    put_by: Annotated[str | None, Meta(description="Who put it; null: it is the site's own file.")]
    put_unix_s: Annotated[float | None, Meta(description="When it was put, Unix time [s].")]
    kept: Annotated[bool, Meta(description="Whether a guard that starts anew has it too.")]
    notes: Annotated[
        tuple[str, ...], Meta(description="What was mended, or is remarkable, in its meshes.")
    ]
