"""Objects that move: where each of them may be now, or that nobody knows.

Each has a key on which its pose comes. At any time every point of it lies within

    grown = max_speed · age of its newest pose

of where that pose puts it, if no point of it is faster than ``max_speed`` and the pose was
measured when its stamp says. The first is checked by the way from pose to pose, the second
against the machine's own stamps; either breach degrades the status by name. Before the first
pose, once the newest is older than the object's time-out, and while its sender's clock is ahead of
the machine's (its age cannot be known then), its placement is None: the sweep answers "unknown",
which the alarm logic takes as contact.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from rampe_guard.core.config import InputConfig
from rampe_guard.core.events import RefusalEvent
from rampe_guard.core.inputs import Continuity, Fault
from rampe_guard.core.monitor import RECENT_S, ObjectHealth, Reason
from rampe_guard.core.scene import SolidObject
from rampe_guard.core.sender_clock import SenderClock
from rampe_guard.core.types import ActuatorSample, FloatArray, Inputs, ObjectSample, Placement

_RIGID = 1e-6
_JITTER_S = 0.1
"""Stamps and positions tremble by about what the object does in this time."""
_STILL_M, _STILL_S, _STILL_RAD = 0.02, 0.02, 0.005
"""An object stands while its poses stay this near each other: [m], way at top speed [s], [rad]."""
_CLOCKS = "the actuators by their stamps: taken as contact; do both come from one clock?"
_SETTLED_S = 2.0
_SEEN_S = 0.5


class MovingObject:
    """One keyed object: its newest pose and the books of its messages.

    Args:
        item: the object in the scene; it has a key.
        config: limits of plausible stamps.
    """

    def __init__(self, item: SolidObject, config: InputConfig) -> None:
        self.name, self.key = item.name, item.key or ""
        self._max_speed, self._timeout_s = item.max_speed, item.timeout_s
        self._gate = Continuity[ObjectSample](item.timeout_s, config.max_stamp_jump_s)
        self._newest: ObjectSample | None = None
        self._measured_s = 0.0
        self._own = SenderClock()
        self._early_s: float | None = None
        self._anchor: FloatArray | None = None
        self._moved_s = 0.0
        self._accepted = 0
        self._rejected: Counter[str] = Counter()
        self._recent: dict[str, float] = {}
        self._too_fast: tuple[float, str] | None = None

    def follows(self, item: SolidObject) -> bool:
        """Whether the poses of ``item`` are those that are followed here, by the same rules."""
        rules = (item.name, item.key or "", item.max_speed, item.timeout_s)
        return rules == (self.name, self.key, self._max_speed, self._timeout_s)

    def take(self, sample: ObjectSample, clock: SenderClock) -> Fault | None:
        """Take a pose, or tell why it was refused."""
        verdict = _fault(sample) or self._gate.check(sample)
        if isinstance(verdict, Fault):
            self.reject(verdict.reason, sample.arrival_s)
            return verdict
        if self._newest is not None and not verdict.restarted:
            self._check_speed(self._newest, sample)
        if verdict.restarted:
            self._own = SenderClock()
        self._newest = sample
        self._measured_s, self._early_s = sample.arrival_s, None
        if sample.stamped:
            self._measured_s = clock.measured_s(sample.stamp_s, sample.arrival_s)
            self._own = self._own.followed(sample.stamp_s, sample.arrival_s)
            self._early_s = clock.early_s(self._own)
        self._accepted += 1
        if self._anchor is None or self._left(self._anchor, sample.pose):
            self._anchor, self._moved_s = sample.pose, sample.arrival_s
        return None

    def reject(self, reason: str, now_s: float) -> None:
        """A message was refused."""
        self._rejected[reason] += 1
        self._recent[reason] = now_s

    def placement(self, now_s: float) -> Placement | None:
        """Where it may be now; None: anywhere."""
        age_s = self._age_s(now_s)
        if self._newest is None or age_s is None or age_s > self._timeout_s:
            return None
        if self._early_s is not None:
            return None
        return Placement(self._newest.pose, self._max_speed * age_s)

    def restless(self, now_s: float) -> bool:
        """It moved of late, or has not been seen standing: it may be coming nearer."""
        age_s = self._age_s(now_s)
        unseen = age_s is None or age_s > _SEEN_S or self._early_s is not None
        return unseen or now_s - self._moved_s < _SETTLED_S

    def health(self, now_s: float) -> ObjectHealth:
        """Age and counts, for the heartbeat."""
        placed = self.placement(now_s)
        return ObjectHealth(
            self.name,
            self.key,
            self._age_s(now_s),
            None if placed is None else placed.grown_m,
            self._accepted,
            dict(self._rejected),
        )

    def weaknesses(self, now_s: float) -> list[Reason]:
        """Why it is not, or not quite, known where it is."""
        found = []
        if self.placement(now_s) is None:
            found.append(self._unplaced(now_s))
        if self._too_fast is not None and now_s - self._too_fast[0] <= RECENT_S:
            found.append(Reason("object_too_fast", None, self._too_fast[1], self.key))
        for reason, at_s in sorted(self._recent.items()):
            if now_s - at_s <= RECENT_S:
                text = f"{self._rejected[reason]} poses of {self.name} refused: {reason}"
                found.append(Reason(f"object_{reason}", None, text, self.key))
        return found

    def _age_s(self, now_s: float) -> float | None:
        return None if self._newest is None else max(now_s - self._measured_s, 0.0)

    def _unplaced(self, now_s: float) -> Reason:
        where = f"{self.name} on {self.key}"
        newest = self._newest
        if newest is None:
            text = f"no good pose of {where} yet: taken as contact"
        elif now_s - newest.arrival_s <= self._timeout_s:
            late_s = newest.arrival_s - self._measured_s
            poses = f"the poses of {where} are"
            if self._early_s is not None:
                text = f"{poses} {self._early_s:.1f} s ahead of {_CLOCKS}"
                return Reason("object_early", None, text, self.key)
            return Reason("object_late", None, f"{poses} {late_s:.1f} s behind {_CLOCKS}", self.key)
        else:
            limit = f"{self._timeout_s:g} s"
            text = f"no good pose of {where} for more than {limit}: taken as contact"
        return Reason("object_silent", None, text, self.key)

    def _check_speed(self, old: ObjectSample, new: ObjectSample) -> None:
        """The pose is taken all the same: it is the best that is known."""
        moved = float(np.linalg.norm(new.pose[:3, 3] - old.pose[:3, 3]))
        step_s = new.stamp_s - old.stamp_s
        if moved > self._max_speed * (step_s + _JITTER_S):
            text = f"{self.name} went {moved:.3g} m in {step_s:.3g} s, max_speed"
            self._too_fast = (new.arrival_s, f"{text} is {self._max_speed:g} m/s")

    def _left(self, anchor: FloatArray, pose: FloatArray) -> bool:
        moved = float(np.linalg.norm(pose[:3, 3] - anchor[:3, 3]))
        turned = float(np.linalg.norm(pose[:3, :3] - anchor[:3, :3])) / np.sqrt(2.0)
        return moved > min(_STILL_M, _STILL_S * self._max_speed) or turned > _STILL_RAD


class MovingObjects:
    """All keyed objects of a scene.

    Args:
        items: the objects that have a key.
        config: limits of plausible stamps.
    """

    def __init__(self, items: Sequence[SolidObject], config: InputConfig) -> None:
        self._config = config
        self._objects = {item.name: MovingObject(item, config) for item in items}
        self._clock = SenderClock()

    def __bool__(self) -> bool:
        return bool(self._objects)

    def change(self, items: Sequence[SolidObject]) -> None:
        """Other objects from now on; one that is followed as before stays where it was seen."""
        old = self._objects
        self._objects = {
            item.name: old[item.name]
            if item.name in old and old[item.name].follows(item)
            else MovingObject(item, self._config)
            for item in items
        }

    def follow(self, sample: ActuatorSample, *, restarted: bool) -> None:
        """Take an accepted position of the machine: its stamp tells how the clocks differ."""
        if restarted:
            self._clock = SenderClock()
        self._clock = self._clock.followed(sample.stamp_s, sample.arrival_s, stamped=sample.stamped)

    def take(self, inputs: Inputs, now_s: float) -> tuple[bool, list[RefusalEvent]]:
        """Take what arrived, in order; whether a pose is new, and what was refused.

        Raises:
            ValueError: it is about an object that has no key in the scene.
        """
        for name, reason in inputs.objects_rejected:
            self._of(name).reject(reason, now_s)
        fresh, refused = False, []
        for sample in inputs.objects:
            fault = self._of(sample.name).take(sample, self._clock)
            if fault is None:
                fresh = True
            else:
                refused.append(RefusalEvent(f"object {sample.name}", fault.reason, fault.detail))
        return fresh, refused

    def placements(self, now_s: float) -> dict[str, Placement | None]:
        """Where each object may be now, by its name; None: anywhere."""
        return {name: item.placement(now_s) for name, item in self._objects.items()}

    def restless(self, zone: str, now_s: float) -> bool:
        """Whether a zone is an object that may be coming nearer by itself."""
        item = self._objects.get(zone)
        return item is not None and item.restless(now_s)

    def health(self, now_s: float) -> tuple[ObjectHealth, ...]:
        """Books of all, in scene order."""
        return tuple(item.health(now_s) for item in self._objects.values())

    def weaknesses(self, now_s: float) -> list[Reason]:
        """Everything that is not as it should be, in scene order."""
        return [r for item in self._objects.values() for r in item.weaknesses(now_s)]

    def _of(self, name: str) -> MovingObject:
        item = self._objects.get(name)
        if item is None:
            known = ", ".join(self._objects) or "none has"
            raise ValueError(f"object {name!r} has no key in this scene ({known})")
        return item


def _fault(sample: ObjectSample) -> Fault | None:
    """What is wrong with one pose by itself."""
    pose = sample.pose
    if pose.shape != (4, 4):
        return Fault("wrong_length", f"a pose of shape {pose.shape}, needs (4, 4)")
    if not (np.isfinite(pose).all() and np.isfinite(sample.stamp_s)):
        return Fault("not_finite", f"position {pose[:3, 3].tolist()}, stamp {sample.stamp_s:g}")
    turn = pose[:3, :3]
    rigid = np.abs(turn @ turn.T - np.eye(3)).max() <= _RIGID and np.linalg.det(turn) > 0.0
    if not (rigid and (pose[3] == (0.0, 0.0, 0.0, 1.0)).all()):
        return Fault("bad_rotation", f"not a rigid motion: {pose.tolist()}")
    return None
