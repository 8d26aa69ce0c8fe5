"""Settings that the core needs, as plain frozen values; settings.py fills them from files."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class ActuatorConfig:
    """One actuator: how the lever names it and how it moves.

    Attributes:
        name: as in the site file and in ``predicted_displacement``.
        axis: index of its joystick axis.
        sign: +1 if a positive axis lengthens / turns it positive, else -1.
        max_velocity: [unit/s].
        max_deceleration: [unit/s²].
        lag_s: command to motion [s].
        deadband: axis size below which no motion is commanded [-].
        unit: "rad" or "m".
    """

    name: str
    axis: int
    sign: int
    max_velocity: float
    max_deceleration: float
    lag_s: float
    deadband: float
    unit: str


@dataclass(frozen=True, slots=True)
class JoystickConfig:
    """How axes become a category: low-pass time [s], hysteresis, debounce [s]."""

    filter_s: float = 0.05
    release_ratio: float = 0.7
    debounce_s: float = 0.08


@dataclass(frozen=True, slots=True)
class PriorConfig:
    """What is believed of a category before it was seen.

    Attributes:
        displacement: usual displacement of an actuator [share of its range].
        spread: standard deviation of a displacement about its model [share of its size].
        weight: how many observations the belief in the mean is worth.
        slope_weight: how many it is worth that displacement does not depend on position
            (affine and quadratic basis).
    """

    displacement: float = 0.1
    spread: float = 1.0
    weight: float = 0.5
    slope_weight: float = 0.5


Basis: TypeAlias = Literal["affine", "quadratic", "radial"]
Observation: TypeAlias = Literal["q", "time", "command_sum", "command", "speed"]


@dataclass(frozen=True, slots=True)
class RampeConfig:
    """The estimator.

    Attributes:
        n_init: own occurrences of a category before its first forecast; with 0, categories
            never seen borrow from related ones.
        basis: what x depends on, for all actuators or one for each.
        forgetting: weight λ of an occurrence after each later one of its category.
        memory: newest occurrences that a category remembers.
        borrow: correlation of categories that differ in one actuator; 0 for none.
        two_futures_from: occurrences from which a category may have two futures.
        prior: belief before the first occurrence.
        observations: what the regressor sees at the start of a primitive.
    """

    n_init: int = 0
    basis: Basis | tuple[Basis, ...] = "radial"
    forgetting: float = 0.98
    memory: int = 32
    borrow: float = 0.5
    two_futures_from: int = 8
    prior: PriorConfig = field(default_factory=PriorConfig)
    observations: tuple[Observation, ...] = ("q",)

    def __post_init__(self) -> None:
        """Refuse what no estimator can work with.

        Raises:
            ValueError: a number is out of its range.
        """
        prior = self.prior
        believed = (prior.displacement, prior.spread, prior.weight, prior.slope_weight)
        for name, value, fits in (
            ("n_init", self.n_init, self.n_init >= 0),
            ("forgetting", self.forgetting, 0.0 < self.forgetting <= 1.0),
            ("memory", self.memory, self.memory >= 1),
            ("borrow", self.borrow, 0.0 <= self.borrow < 1.0),
            ("two_futures_from", self.two_futures_from, self.two_futures_from >= 1),
            ("prior", believed, all(0.0 < part < math.inf for part in believed)),
        ):
            if not fits:
                raise ValueError(f"{name} is {value}: out of range")


@dataclass(frozen=True, slots=True)
class StoppingConfig:
    """The stopping forecast: the operator's reaction time [s]."""

    reaction_s: float = 0.3


@dataclass(frozen=True, slots=True)
class AdviceConfig:
    """Speed advice for machines that shape the operator's command.

    Attributes:
        enabled: whether it is given.
        hold_s: how long a command may follow one advice [s]; then the next one must have come.
        period_s: from one advice to the next [s].
        rise_per_s: how fast a share may rise [1/s].
    """

    enabled: bool = False
    hold_s: float = 0.25
    period_s: float = 0.05
    rise_per_s: float = 2.0


@dataclass(frozen=True, slots=True)
class NextConfig:
    """The forecast of what follows, from the memory of situations.

    Attributes:
        enabled: whether memory speaks.
        horizon_s: how far it looks [s].
        analogues: how many similar situations are asked.
        situations: how many are remembered; a day of work is some 200,000.
    """

    enabled: bool = True
    horizon_s: float = 2.5
    analogues: int = 8
    situations: int = 200_000


@dataclass(frozen=True, slots=True)
class SweepConfig:
    """Tolerance of a contact [m], of a clearance [m], and the budget of clearance queries."""

    tolerance_m: float = 0.0002
    clearance_tolerance_m: float = 0.05
    max_queries: int = 20000


@dataclass(frozen=True, slots=True)
class AlertConfig:
    """When an alert is raised, held and given back.

    Attributes:
        imminent_probability: smallest probability of contact at which a stopping path that
            touches is imminent [-]; where it touches whatever the operator does, it always is.
        warning_probability: smallest probability of contact that warns [-].
        caution_probability: smallest probability of contact that is a caution [-].
        debounce_steps: evaluations in a row before a caution or warning is published.
        imminent_steps: the same for imminent.
        release_steps: evaluations in a row without a cause before its alert goes.
        off_delay_s: how long a cause must be gone before its alert goes [s].
        min_on_s: shortest life of an alert [s].
        deadband_m: extra clearance that must be regained [m].
        deadband_s: extra time to collision that must be regained [s].
        deadband_probability: how far below the threshold the probability must fall [-].
        republish_s: period of repeats while an alert is active [s].
        expires_after_s: age at which a consumer must no longer trust a message [s].
        horizon_s: contacts further away in time than this are a caution at most [s].
        realarm_s: an alert that goes on asks for attention again after this time [s].
        shelve_max_s: longest time for which an alert may be shelved [s].
    """

    imminent_probability: float = 0.25
    warning_probability: float = 0.2
    caution_probability: float = 0.1
    debounce_steps: int = 2
    imminent_steps: int = 1
    release_steps: int = 5
    off_delay_s: float = 0.5
    min_on_s: float = 1.0
    deadband_m: float = 0.02
    deadband_s: float = 0.2
    deadband_probability: float = 0.1
    republish_s: float = 0.2
    expires_after_s: float = 1.0
    horizon_s: float = 6.0
    realarm_s: float = 60.0
    shelve_max_s: float = 30.0


@dataclass(frozen=True, slots=True)
class InputConfig:
    """Limits of plausible input.

    Attributes:
        joystick_timeout_s: silence after which monitoring stops [s].
        actuators_timeout_s: the same for the actuators [s].
        joystick_on_change: the joystick publishes only when it moves, so its silence is
            no fault by itself.
        position_slack: how far a position may lie beyond its limits [share of the range].
        speed_slack: how many times ``max_velocity`` a measured speed may be [-].
        max_stamp_jump_s: largest step of a stamp beyond the time that really passed [s].
        max_clock_loss: how much stamps may lose on the true time before messages are late [s/s].
        enabled_timeout_s: how long the machine's word that it is switched off holds [s]; None
            if it has no key to say so.
        max_rate_hz: messages of each input that are looked at in the long run [1/s].
    """

    joystick_timeout_s: float = 0.5
    actuators_timeout_s: float = 0.5
    joystick_on_change: bool = False
    position_slack: float = 0.05
    speed_slack: float = 5.0
    max_stamp_jump_s: float = 1.0
    max_clock_loss: float = 1e-3
    enabled_timeout_s: float | None = None
    max_rate_hz: float = 1000.0


@dataclass(frozen=True, slots=True)
class GuardConfig:
    """Everything `Guard` is built from, except geometry."""

    actuators: tuple[ActuatorConfig, ...]
    joystick: JoystickConfig = field(default_factory=JoystickConfig)
    rampe: RampeConfig = field(default_factory=RampeConfig)
    stopping: StoppingConfig = field(default_factory=StoppingConfig)
    next: NextConfig = field(default_factory=NextConfig)
    alerts: AlertConfig = field(default_factory=AlertConfig)
    inputs: InputConfig = field(default_factory=InputConfig)
    advice: AdviceConfig = field(default_factory=AdviceConfig)
    axes: int = 0
    """Number of joystick axes that a message must have at least."""
