"""The keys of a guard: what lies on each, which way it goes, and with which quality of service.

`KEYS` is the table from which the AsyncAPI document is made; the session that publishes is
`runtime.zenoh_io`, and a test holds what it really sends against this table.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

Way: TypeAlias = Literal["taken", "published", "answered", "held"]


@dataclass(frozen=True, slots=True)
class Key:
    """One key.

    Attributes:
        name: in the AsyncAPI document.
        address: the key; ``{base}`` and other parameters come from the site file.
        way: taken by the guard, published by it, a query that it answers, or a token it holds.
        text: when, and what for.
        message: schema of what is taken, published or asked; None: no payload.
        reply: schema of an answer to a query.
        urgent: published before other traffic.
    """

    name: str
    address: str
    way: Way
    text: str
    message: str | None = None
    reply: str | None = None
    urgent: bool = False


PARAMETERS: Final[dict[str, tuple[str, str]]] = {
    "joystick": (
        "`keys.joystick` of the site file, an exact key.",
        "rampe/quarry-north/excavator-7/joystick",
    ),
    "actuators": (
        "`keys.actuators` of the site file, an exact key.",
        "rampe/quarry-north/excavator-7/actuators",
    ),
    "pose": (
        "`key` of a moving object in the scene file, an exact key.",
        "rampe/quarry-north/truck-1/pose",
    ),
    "enabled": (
        "`keys.enabled` of the site file, an exact key; may be left out.",
        "rampe/quarry-north/excavator-7/enabled",
    ),
    "base": (
        "`keys.base` of the site file, a guard's prefix; `rampe/*/*/guard` are usually all guards.",
        "rampe/quarry-north/excavator-7/guard",
    ),
}
"""What stands in braces in an address: what it is, and an example."""

KEYS: Final[tuple[Key, ...]] = (
    Key(
        "joystick",
        "{joystick}",
        "taken",
        "Lever positions, 20 Hz or more; stamps of all inputs come from one clock.",
        "rampe.joystick.v1",
    ),
    Key(
        "actuators",
        "{actuators}",
        "taken",
        "Positions, 20 Hz or more.",
        "rampe.actuators.v1",
    ),
    Key(
        "objectPose",
        "{pose}",
        "taken",
        "Where an object that moves is, 10 Hz or more; a key for each such object.",
        "rampe.object_pose.v1",
    ),
    Key(
        "enabled",
        "{enabled}",
        "taken",
        "Whether the machine is switched on. Only a fresh `false` counts as off; silence is on.",
        "rampe.enabled.v1",
    ),
    Key(
        "alert",
        "{base}/alert",
        "published",
        "At every transition, and 5 Hz while the alert is active; its end is told by level"
        " `clear`. Older than its `expires_after_s`, an alert must not be trusted, nor its"
        " absence: show that protection is unavailable.",
        "rampe.alert.v1",
        urgent=True,
    ),
    Key(
        "prediction",
        "{base}/prediction",
        "published",
        "A primitive starts or ends, or its forecast changes.",
        "rampe.prediction.v1",
    ),
    Key(
        "advice",
        "{base}/advice",
        "published",
        "20 Hz while `advice.enabled` of the site file: how much each actuator may be commanded so"
        " that the arm can stop short of every zone. Advisory only. Older than its"
        " `expires_after_s`, there is none, which is not the same as free.",
        "rampe.advice.v1",
        urgent=True,
    ),
    Key(
        "heartbeat",
        "{base}/heartbeat",
        "published",
        "5 Hz from the worker loop, always. Without it nobody is protected, whatever else comes.",
        "rampe.heartbeat.v1",
        urgent=True,
    ),
    Key(
        "state",
        "{base}/state",
        "answered",
        "All of the above at once, for who comes late.",
        None,
        "rampe.state.v1",
    ),
    Key(
        "ack",
        "{base}/ack",
        "answered",
        "Acknowledge an alert; the answer is the alert, or an error in words.",
        "rampe.ack.v1",
        "rampe.alert.v1",
    ),
    Key(
        "shelve",
        "{base}/shelve",
        "answered",
        "Silence an alert for a time, at most 30 s; the answer is the alert, or an error in words."
        " `imminent` cannot be shelved.",
        "rampe.shelve.v1",
        "rampe.alert.v1",
    ),
    Key(
        "scene",
        "{base}/scene",
        "answered",
        "The keep-out scene in force. Its hash is in every heartbeat: ask again when it changes.",
        None,
        "rampe.scene.v1",
    ),
    Key(
        "scenePut",
        "{base}/scene/put",
        "answered",
        "Replace the scene while the guard works; the answer is the scene then in force, or every"
        " error in words, and the old one stays. A key of its own, so that a router's access list"
        " can tell who may.",
        "rampe.scene_put.v1",
        "rampe.scene.v1",
    ),
    Key(
        "forget",
        "{base}/forget",
        "answered",
        "Forget all that was learned of the operator; the answer tells how much that was.",
        "rampe.forget.v1",
        "rampe.forgotten.v1",
    ),
    Key(
        "alive",
        "{base}/alive",
        "held",
        "Liveliness token: it goes when the guard's session does. It does not replace the"
        " heartbeat, which stops when the loop is stuck.",
    ),
    Key(
        "recorder",
        "{base}/recorder",
        "published",
        "1 Hz from each `rampe-guard record` beside the guard, which also holds a liveliness token"
        " of this name; nobody's protection depends on it.",
        "rampe.recorder.v1",
    ),
)
