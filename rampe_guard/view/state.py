"""What the terminal shows, as one frozen value. All times are on the clock of the viewer."""

from __future__ import annotations

from dataclasses import dataclass, field

from rampe_guard.client.contact import Contact
from rampe_guard.client.items import Protection
from rampe_guard.core.alarm import Level


@dataclass(frozen=True, slots=True)
class ActuatorView:
    """One actuator; what is not known is None.

    Attributes:
        name: as in the site file.
        unit: "rad" or "m".
        lower: limit of travel [unit]; None = endless.
        upper: the same.
        position: [unit].
        velocity: [unit/s].
        command: of the lever, in the actuator's direction, in [-1, 1].
        sign: direction in the category, -1, 0 or 1.
        displacement: predicted for this primitive, x̂ [unit].
        spread: of the prediction [unit].
        endpoint: predicted [unit].
        axis: index of its joystick axis.
        axis_sign: +1 if a positive axis moves it up, else -1.
    """

    name: str
    unit: str = "rad"
    lower: float | None = None
    upper: float | None = None
    position: float | None = None
    velocity: float | None = None
    command: float | None = None
    sign: int | None = None
    displacement: float | None = None
    spread: float | None = None
    endpoint: float | None = None
    axis: int = 0
    axis_sign: int = 1


@dataclass(frozen=True, slots=True)
class AlertView:
    """One active alert.

    Attributes:
        alert_id: names the alert; the zone names its line.
        zone: keep-out object.
        level: how urgent.
        boot_id: of the guard that raised it.
        source: stopping, intent, next, contact or system.
        link: of the arm, or None.
        time_to_collision_s: [s].
        probability: of contact [-].
        clearance_now_m: to the margin [m].
        attention: nobody has acknowledged it.
        gone: its cause is gone; it only waits to be acknowledged.
        trusted: the guard says that its quality is good.
        text: the guard's own words.
        sent_s: when the message was sent, at the latest [s].
        expires_after_s: age at which it must not be trusted [s].
        warned_unix_s: when it first warned, on the guard's clock [s]; None below warning.
        came_true: the arm went in.
        inhibit: why nobody is to be troubled: "none", "shelved" or "machine_off".
        shelved_by: who shelved it.
        shelved_for_s: for how long from ``sent_s`` on [s].
        acked_by: who acknowledged it.
        times: how many of how many similar situations touched; None where memory is silent.
    """

    alert_id: str
    zone: str
    level: Level
    boot_id: str = ""
    source: str = "intent"
    link: str | None = None
    time_to_collision_s: float | None = None
    probability: float | None = None
    clearance_now_m: float | None = None
    attention: bool = True
    gone: bool = False
    trusted: bool = True
    text: str = ""
    sent_s: float = 0.0
    expires_after_s: float = 1.0
    warned_unix_s: float | None = None
    came_true: bool = False
    inhibit: str = "none"
    shelved_by: str | None = None
    shelved_for_s: float | None = None
    acked_by: str | None = None
    times: tuple[int, int] | None = None

    @property
    def flashes(self) -> bool:
        """It asks for attention: nobody has seen it, its cause is there, nobody silenced it."""
        return self.attention and not self.gone and self.inhibit == "none"

    def stale(self, now_s: float) -> bool:
        """It was not repeated in time: still shown, no longer current."""
        return now_s - self.sent_s > self.expires_after_s

    def shelved_left_s(self, now_s: float) -> float | None:
        """Until it will ask again [s]."""
        if self.shelved_for_s is None:
            return None
        return max(0.0, self.sent_s + self.shelved_for_s - now_s)


@dataclass(frozen=True, slots=True)
class HealthView:
    """The last heartbeat.

    Attributes:
        protection: what it says of monitoring.
        reasons: in words.
        boot_id: changes when the guard restarts.
        joystick_age_s: of the newest joystick sample then [s].
        actuators_age_s: the same for the actuators [s].
        loop_p50_ms: loop time [ms].
        loop_p99_ms: the same [ms].
        sweep_p50_ms: sweep time [ms].
        sweep_p99_ms: the same [ms].
        version: of the guard.
    """

    protection: Protection
    reasons: tuple[str, ...]
    boot_id: str
    joystick_age_s: float | None = None
    actuators_age_s: float | None = None
    loop_p50_ms: float | None = None
    loop_p99_ms: float | None = None
    sweep_p50_ms: float | None = None
    sweep_p99_ms: float | None = None
    version: str = ""


@dataclass(frozen=True, slots=True)
class EventView:
    """Something that happened at ``at_s`` [s], with the level that colours it.

    ``lost`` says that nobody is protected since.
    """

    at_s: float
    level: Level
    text: str
    lost: bool = False


@dataclass(frozen=True, slots=True)
class ViewState:
    """Everything on the screen.

    Attributes:
        machine: its name.
        site: its name.
        now_s: time of the picture [s].
        actuators: in site order.
        observations: primitives behind the prediction, or None without one.
        position_received_s: when positions last came [s]; None = never.
        command_received_s: when lever positions last came [s]; None = never.
        prediction_received_s: when a prediction last came [s]; None = none in force.
        health: last heartbeat; None = never one.
        alerts: active ones, at most one per zone.
        events: newest first.
        expires_after_s: age at which heartbeat, position and command are stale [s].
        began_s: when the watch began [s]; None = long ago.
        told: the protection that was last told among the events.
        contact: how fresh the heartbeat is, and whether all alerts are known.
    """

    machine: str
    site: str
    now_s: float
    actuators: tuple[ActuatorView, ...]
    observations: int | None = None
    position_received_s: float | None = None
    command_received_s: float | None = None
    prediction_received_s: float | None = None
    health: HealthView | None = None
    alerts: tuple[AlertView, ...] = ()
    events: tuple[EventView, ...] = ()
    expires_after_s: float = 1.0
    began_s: float | None = None
    told: Protection | None = None
    contact: Contact = field(default_factory=Contact)

    @property
    def silence_s(self) -> float | None:
        """Time since the last heartbeat was sent [s], at least; None if there never was one."""
        beat_s = self.contact.beat_s
        return None if beat_s is None else self.now_s - beat_s

    @property
    def silent(self) -> bool:
        """No heartbeat, or too old a one."""
        return self.contact.silent(self.now_s, self.expires_after_s)

    @property
    def protection(self) -> Protection:
        """What can be relied on now: a heartbeat that is too old protects nobody."""
        if self.health is None or self.silent:
            return Protection.UNAVAILABLE
        if self.health.protection.guarded and not self.contact.complete(self.now_s):
            return Protection.UNAVAILABLE
        return self.health.protection

    @property
    def why(self) -> str:
        """Why it is not plainly monitoring, in words."""
        if self.protection is not Protection.UNAVAILABLE:
            reasons = "; ".join(self.health.reasons) if self.health is not None else ""
            return reasons or "the guard gave no reason"
        if self.silence_s is None:
            return "no message from the guard yet"
        if not self.silent:
            return "the guard is heard again, its alerts are not all known yet"
        return f"no message from the guard for {self.silence_s:.1f} s"

    @property
    def seen(self) -> bool:
        """Somebody has acknowledged that it does not monitor; for a silent guard nobody can."""
        if self.protection is not Protection.NOT_MONITORING:
            return False
        return any(a.source == "system" and not a.attention for a in self.alerts)

    @property
    def position_stale(self) -> bool:
        """Positions are missing or too old to be shown as present."""
        return self._too_old(self.position_received_s)

    @property
    def command_stale(self) -> bool:
        """The same of lever positions."""
        return self._too_old(self.command_received_s)

    def _too_old(self, received_s: float | None) -> bool:
        return received_s is None or self.now_s - received_s > self.expires_after_s
