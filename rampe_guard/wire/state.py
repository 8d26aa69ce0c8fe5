"""``{base}/state``: everything at once, for who comes late."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import Meta

from rampe_guard.wire import fields as f
from rampe_guard.wire.alert import Alert
from rampe_guard.wire.codec import Message
from rampe_guard.wire.health import Heartbeat
from rampe_guard.wire.prediction import Prediction

SCHEMA: Final = "rampe.state.v1"


class State(Message, frozen=True, kw_only=True):
    """The newest of every message, and where the arm is."""

    schema: Annotated[
        Literal["rampe.state.v1"], Meta(description="Name and version of this contract.")
    ] = SCHEMA
    heartbeat: Annotated[Heartbeat, Meta(description="The newest heartbeat.")]
    alerts: Annotated[tuple[Alert, ...], Meta(description="Every alert that is not normal.")]
    predictions: Annotated[
        tuple[Prediction, ...], Meta(description="The newest prediction; empty before the first.")
    ]
    position: Annotated[
        f.ByActuator | None,
        Meta(description="Newest accepted position by actuator [rad or m]; null before it."),
    ]
