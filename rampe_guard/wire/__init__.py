"""The message contract: msgspec structs, JSON in and out, JSON Schema.

What arrives is decoded strictly and refused with a reason; what leaves is checked to be
finite. Names carry units (``_s``, ``_m``, ``_ms``, ``_hz``); actuator values are in the
site's units.
"""

from rampe_guard.wire.ack import Ack
from rampe_guard.wire.advice import ActuatorAdvice, Advice
from rampe_guard.wire.alert import Alert, by_urgency
from rampe_guard.wire.codec import MAX_PAYLOAD_BYTES, decode, encode
from rampe_guard.wire.forget import Forget, Forgotten
from rampe_guard.wire.health import (
    CanaryTrial,
    Commands,
    Heartbeat,
    InputAges,
    InputRates,
    Learned,
    ObjectInput,
    Quantiles,
    Reason,
    Remembered,
    Resources,
)
from rampe_guard.wire.inputs import (
    ActuatorsMessage,
    EnabledMessage,
    JoystickMessage,
    ObjectPose,
    decode_actuators,
    decode_enabled,
    decode_joystick,
    decode_object_pose,
)
from rampe_guard.wire.prediction import Endpoint, Prediction, PredictionSweep, Scenario
from rampe_guard.wire.recorder import Recorder
from rampe_guard.wire.scene import MAX_SCENE_BYTES, SceneInForce, ScenePut
from rampe_guard.wire.schema import json_schemas
from rampe_guard.wire.shelve import Shelve
from rampe_guard.wire.state import State
from rampe_guard.wire.sweep import SweepReply, SweepRequest, decode_sweep_request
from rampe_guard.wire.text import MAX_TEXT, advice_text, alert_text, in_full, no_advice_text

__all__ = [
    "MAX_PAYLOAD_BYTES",
    "MAX_SCENE_BYTES",
    "MAX_TEXT",
    "Ack",
    "ActuatorAdvice",
    "ActuatorsMessage",
    "Advice",
    "Alert",
    "CanaryTrial",
    "Commands",
    "EnabledMessage",
    "Endpoint",
    "Forget",
    "Forgotten",
    "Heartbeat",
    "InputAges",
    "InputRates",
    "JoystickMessage",
    "Learned",
    "ObjectInput",
    "ObjectPose",
    "Prediction",
    "PredictionSweep",
    "Quantiles",
    "Reason",
    "Recorder",
    "Remembered",
    "Resources",
    "Scenario",
    "SceneInForce",
    "ScenePut",
    "Shelve",
    "State",
    "SweepReply",
    "SweepRequest",
    "advice_text",
    "alert_text",
    "by_urgency",
    "decode",
    "decode_actuators",
    "decode_enabled",
    "decode_joystick",
    "decode_object_pose",
    "decode_sweep_request",
    "encode",
    "in_full",
    "json_schemas",
    "no_advice_text",
]
