"""Messages that we send: complete, finite, and as their JSON Schemas say."""

from __future__ import annotations

import json
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import msgspec
import numpy as np
import pytest

from rampe_guard.core.types import Certificate
from rampe_guard.errors import MessageError
from rampe_guard.wire import (
    Alert,
    CanaryTrial,
    Heartbeat,
    InputAges,
    InputRates,
    ObjectInput,
    Prediction,
    PredictionSweep,
    Quantiles,
    Reason,
    Remembered,
    Scenario,
    State,
    SweepReply,
    decode,
    encode,
    json_schemas,
)

DESIGNED_ALERT = [
    "schema", "alert_id", "boot_id", "seq", "site", "machine", "source", "level",
    "previous_level", "state", "inhibit", "quality", "zone", "link", "probability",
    "time_to_collision_s", "clearance_m", "clearance_now_m", "contact_point_m",
    "contact_fraction", "any_path", "category", "observations", "predicted_displacement",
    "predicted_endpoint", "similar_situations", "similar_contacts", "stamp", "published_unix_s",
    "uptime_s", "input_age_s", "compute_ms", "raised_unix_s", "changed_unix_s", "acked_by",
    "shelved_by", "shelved_until_unix_s", "expires_after_s", "text",
]  # fmt: skip

ALERT = Alert(
    alert_id="a",
    boot_id="b",
    seq=17,
    site="quarry",
    machine="excavator",
    source="intent",
    level="warning",
    previous_level="clear",
    state="unacked",
    inhibit="none",
    quality="good",
    zone="cab-wall",
    link="bucket",
    probability=0.83,
    time_to_collision_s=1.42,
    clearance_m=0.0,
    clearance_now_m=0.91,
    contact_point_m=(5.9, 0.2, 1.1),
    contact_fraction=0.64,
    any_path="possible",
    category=(1, 0),
    observations=12,
    predicted_displacement={"swing": 0.7},
    predicted_endpoint={"swing": 1.9},
    similar_situations=8,
    similar_contacts=6,
    stamp=12.34,
    published_unix_s=1.7e9,
    input_age_s=0.012,
    compute_ms=1.3,
    raised_unix_s=1.7e9,
    changed_unix_s=1.7e9,
    acked_by=None,
    expires_after_s=1.0,
    text="bucket → cab-wall in 1.4 s",
)
PREDICTION = Prediction(
    boot_id="b",
    seq=1,
    site="quarry",
    machine="excavator",
    event="started",
    category=(1, 0),
    observations=0,
    mean=None,
    scale=None,
    dof=None,
    start={"swing": 0.0},
    endpoint=None,
    progress={"swing": 0.0},
    displacement=None,
    learned=None,
    any_path=None,
    sweeps=(
        PredictionSweep(
            source="stopping",
            zone="cab-wall",
            certificate="unknown",
            contact_fraction=0.0,
            link=None,
            contact_point_m=None,
            clearance_m=None,
            clearance_now_m=None,
            probability=None,
            time_to_collision_s=None,
        ),
    ),
    scenarios=(Scenario(share=0.7, count=6, duration_s=2.5, endpoint={"swing": 1.9}),),
    stamp=None,
    published_unix_s=1.7e9,
)
HEARTBEAT = Heartbeat(
    boot_id="b",
    seq=1,
    site="quarry",
    machine="excavator",
    status="not_monitoring",
    reasons=(Reason(code="joystick_silent", text="no joystick", key="a/b"),),
    input_age_s=InputAges(joystick_s=None, actuators_s=0.1),
    rates_hz=InputRates(joystick=None, actuators=50.0),
    accepted={"joystick": 0, "actuators": 10},
    rejected={"joystick": {"bad_json": 2}},
    memory=Remembered(situations=200_000, work_s=28_800.0),
    objects=(
        ObjectInput(
            name="truck",
            key="a/truck",
            placed=True,
            age_s=0.1,
            grown_m=0.2,
            rate_hz=10.0,
            accepted=100,
            rejected={"bad_rotation": 1},
        ),
    ),
    canary=CanaryTrial(result="ok", age_s=1.5),
    primitives={"learned": 3, "outlier": 1},
    drops=None,
    loop_ms=Quantiles(p50=1.0, p99=3.0),
    sweep_ms=None,
    tick=10,
    scene_hash="0",
    config_hash="1",
    version="0.1.0",
    published_unix_s=1.7e9,
    uptime_s=2.0,
)
REPLY = SweepReply(
    certificate="unknown",
    contact_fraction=None,
    link=None,
    zone=None,
    contact_point_m=None,
    clearance_m=None,
    any_path="unknown",
    elapsed_ms=None,
    error="start has 1 value",
)
SAMPLES: dict[str, msgspec.Struct] = {
    "rampe.alert.v1": ALERT,
    "rampe.prediction.v1": PREDICTION,
    "rampe.heartbeat.v1": HEARTBEAT,
    "rampe.state.v1": State(
        heartbeat=HEARTBEAT, alerts=(ALERT,), predictions=(PREDICTION,), position=None
    ),
    "rampe.sweep_reply.v1": REPLY,
}


def test_alert_has_every_field_of_the_contract_in_its_order() -> None:
    assert list(json.loads(encode(ALERT))) == DESIGNED_ALERT


@pytest.mark.parametrize("name", SAMPLES)
def test_message_fits_its_schema_and_comes_back_the_same(name: str) -> None:
    payload = encode(SAMPLES[name])
    plain = json.loads(payload)
    validator = jsonschema.Draft202012Validator(json_schemas()[name])
    validator.validate(plain)
    assert decode(payload, type(SAMPLES[name])) == SAMPLES[name]
    for field in plain:
        with pytest.raises(jsonschema.ValidationError):
            validator.validate({key: value for key, value in plain.items() if key != field})


@pytest.mark.parametrize("name", json_schemas())
def test_every_field_is_described(name: str) -> None:
    schema = json_schemas()[name]
    jsonschema.Draft202012Validator.check_schema(schema)
    for part in (schema, *schema.get("$defs", {}).values()):
        missing = [key for key, field in part["properties"].items() if "description" not in field]
        assert missing == []


@pytest.mark.parametrize(
    ("name", "payload", "fits"),
    [
        ("rampe.joystick.v1", {"axes": [0, 1], "buttons": []}, True),
        ("rampe.joystick.v1", {"axes": [0, 2]}, False),
        ("rampe.actuators.v1", {"position": [0.1], "stamp": None, "velocity": None}, True),
        ("rampe.actuators.v1", {"velocity": [0.1]}, False),
        ("rampe.object_pose.v1", {"xyz_m": [0, 0, 0], "rpy_rad": [0, 0, 1]}, True),
        ("rampe.object_pose.v1", {"xyz_m": [0, 0], "rpy_rad": [0, 0, 1]}, False),
        ("rampe.object_pose.v1", {"xyz_m": [0, 0, 0], "quaternion_xyzw": [0, 0, 1]}, False),
        ("rampe.sweep_request.v1", {"start": [0], "displacement": [1]}, True),
    ],
)
def test_schema_of_what_arrives(name: str, payload: dict[str, Any], fits: bool) -> None:
    assert jsonschema.Draft202012Validator(json_schemas()[name]).is_valid(payload) is fits


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"clearance_m": float("nan")}, "Alert.clearance_m is nan"),
        ({"probability": np.float64("inf")}, "Alert.probability is inf"),
        ({"contact_point_m": (0.0, float("nan"), 0.0)}, "Alert.contact_point_m[1] is nan"),
        ({"predicted_endpoint": {"boom": float("-inf")}}, "Alert.predicted_endpoint.boom is -inf"),
        ({"contact_point_m": np.array([0.0, 0.0, np.nan])}, "Alert.contact_point_m[2] is nan"),
    ],
)
def test_what_is_not_finite_is_never_sent(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(MessageError, match="not_finite: ") as caught:
        encode(msgspec.structs.replace(ALERT, **changes))
    assert field in str(caught.value)


def test_numpy_values_and_enums_become_plain() -> None:
    point = np.array([1.0, 2.0, 3.0])
    changed = msgspec.structs.replace(
        ALERT, seq=np.int64(3), probability=np.float64(0.5), contact_point_m=point
    )
    plain = json.loads(encode(changed))
    assert (plain["seq"], plain["probability"]) == (3, 0.5)
    assert plain["contact_point_m"] == [1, 2, 3]
    reply = msgspec.structs.replace(REPLY, certificate=Certificate.CONTACT)
    assert json.loads(encode(reply))["certificate"] == "contact"


def test_what_json_cannot_say_is_a_bug() -> None:
    with pytest.raises(TypeError, match=r"SweepReply\.error is a bytes"):
        encode(msgspec.structs.replace(REPLY, error=b"x"))


def test_consumer_takes_unknown_fields_and_refuses_another_contract() -> None:
    plain = json.loads(encode(ALERT))
    assert decode(json.dumps(plain | {"new": 1}).encode(), Alert) == ALERT
    for wrong in ({"schema": "rampe.alert.v2"}, {"level": "red"}, {"seq": "17"}):
        with pytest.raises(MessageError, match="bad_json"):
            decode(json.dumps(plain | wrong).encode(), Alert)
