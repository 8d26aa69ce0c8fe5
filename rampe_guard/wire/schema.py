"""JSON Schema 2020-12 of every message, generated from the structs."""

from __future__ import annotations

from typing import Any

import msgspec

from rampe_guard.wire.ack import Ack
from rampe_guard.wire.advice import Advice
from rampe_guard.wire.alert import Alert
from rampe_guard.wire.forget import Forget, Forgotten
from rampe_guard.wire.health import Heartbeat
from rampe_guard.wire.inputs import ActuatorsMessage, EnabledMessage, JoystickMessage, ObjectPose
from rampe_guard.wire.prediction import Prediction
from rampe_guard.wire.recorder import Recorder
from rampe_guard.wire.scene import SceneInForce, ScenePut
from rampe_guard.wire.shelve import Shelve
from rampe_guard.wire.state import State
from rampe_guard.wire.sweep import SweepReply, SweepRequest

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_TAKEN: dict[str, type[msgspec.Struct]] = {
    "rampe.joystick.v1": JoystickMessage,
    "rampe.actuators.v1": ActuatorsMessage,
    "rampe.object_pose.v1": ObjectPose,
    "rampe.enabled.v1": EnabledMessage,
    "rampe.ack.v1": Ack,
    "rampe.shelve.v1": Shelve,
    "rampe.scene_put.v1": ScenePut,
    "rampe.forget.v1": Forget,
    "rampe.sweep_request.v1": SweepRequest,
}
_SENT: dict[str, type[msgspec.Struct]] = {
    "rampe.alert.v1": Alert,
    "rampe.prediction.v1": Prediction,
    "rampe.advice.v1": Advice,
    "rampe.heartbeat.v1": Heartbeat,
    "rampe.state.v1": State,
    "rampe.recorder.v1": Recorder,
    "rampe.scene.v1": SceneInForce,
    "rampe.forgotten.v1": Forgotten,
    "rampe.sweep_reply.v1": SweepReply,
}


def json_schemas() -> dict[str, dict[str, Any]]:
    """JSON Schema by name of the message; in what we send, every field is always there."""
    schemas = {name: _schema(kind, name) for name, kind in (_TAKEN | _SENT).items()}
    for name in _SENT:
        for definition in (schemas[name], *schemas[name].get("$defs", {}).values()):
            if "properties" in definition:
                definition["required"] = list(definition["properties"])
    return schemas


def _schema(kind: type[msgspec.Struct], name: str) -> dict[str, Any]:
    """Schema of ``kind`` with its own definition at the root."""
    schema = msgspec.json.schema(kind)
    definitions = schema["$defs"]
    own = definitions.pop(kind.__name__)
    head = {"$schema": DIALECT, "$id": f"urn:{name.replace('.', ':')}"}
    return {**head, **own, **({"$defs": definitions} if definitions else {})}
