"""The optional blocks of a site file; every default is the one in core/config.py."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rampe_guard.core.config import (
    AdviceConfig,
    AlertConfig,
    Basis,
    InputConfig,
    JoystickConfig,
    NextConfig,
    Observation,
    PriorConfig,
    RampeConfig,
    StoppingConfig,
    SweepConfig,
)
from rampe_guard.settings.model import Fraction, Model, Seconds, Text

_JOYSTICK = JoystickConfig()
_PRIOR = PriorConfig()
_RAMPE = RampeConfig()
_SWEEP = SweepConfig()
_ALERTS = AlertConfig()
_NEXT = NextConfig()
_ADVICE = AdviceConfig()
_INPUTS = InputConfig()

_Timeout = Annotated[float, Field(ge=0.02, le=60.0)]
_Steps = Annotated[int, Field(ge=1, le=100)]
_Share = Annotated[float, Field(gt=0.0, le=10.0)]
_Weight = Annotated[float, Field(gt=0.0, le=1e6)]
_Tolerance = Annotated[float, Field(ge=1e-6, le=1.0)]
_Observations = Annotated[tuple[Observation, ...], Field(min_length=1, max_length=5)]


class JoystickModel(Model):
    """How axes become a category."""

    filter_s: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=_JOYSTICK.filter_s, description="The time constant of the axis low-pass filter [s]."
    )
    release_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=_JOYSTICK.release_ratio,
        description="The share of the deadband below which a lever counts as released [-].",
    )
    debounce_s: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=_JOYSTICK.debounce_s, description="The time a category must last to count [s]."
    )


class PriorModel(Model):
    """What is believed of a category before it was seen."""

    displacement: _Share = Field(
        default=_PRIOR.displacement,
        description="The usual displacement of an actuator [share of its range].",
    )
    spread: _Share = Field(
        default=_PRIOR.spread,
        description="The standard deviation of a displacement about its model [share of its size].",
    )
    weight: _Weight = Field(
        default=_PRIOR.weight,
        description="The number of observations the belief in the mean is worth.",
    )
    slope_weight: _Weight = Field(
        default=_PRIOR.slope_weight,
        description="The number of observations the belief is worth that displacement does not "
        "depend on position (affine and quadratic basis).",
    )


class RampeModel(Model):
    """The estimator of the operator's next displacement."""

    n_init: Annotated[int, Field(ge=0, le=1000)] = Field(
        default=_RAMPE.n_init,
        description="The own occurrences of a category before its first forecast; with 0, "
        "categories never seen borrow from related ones.",
    )
    basis: Basis | tuple[Basis, ...] = Field(
        default=_RAMPE.basis,
        description="What displacement depends on, for all actuators or a list with one for each: "
        "affine and quadratic functions of the start, or radial, a Gaussian process.",
    )
    forgetting: Annotated[float, Field(ge=0.5, le=1.0)] = Field(
        default=_RAMPE.forgetting,
        description="The forgetting factor per occurrence, 1 for none [-].",
    )
    memory: Annotated[int, Field(ge=4, le=256)] = Field(
        default=_RAMPE.memory,
        description="The number of newest occurrences that a category remembers.",
    )
    borrow: Annotated[float, Field(ge=0.0, lt=1.0)] = Field(
        default=_RAMPE.borrow,
        description="The correlation of categories that differ in one actuator, 0 for none [-].",
    )
    two_futures_from: Annotated[int, Field(ge=8, le=1_000_000)] = Field(
        default=_RAMPE.two_futures_from,
        description="The remembered occurrences from which two futures of one start are told.",
    )
    prior: PriorModel = Field(
        default=PriorModel(), description="The belief before a category was ever seen."
    )
    observations: _Observations = Field(
        default=_RAMPE.observations,
        description="What the estimator sees at the start of a primitive: q, the positions; time "
        "since the start; command_sum, the integral of the command since the last primitive; "
        "command; speed.",
    )


class StoppingModel(Model):
    """The stopping forecast: where the arm stops if the operator lets go now."""

    reaction_s: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=StoppingConfig().reaction_s, description="The operator's reaction time [s]."
    )


class AdviceModel(Model):
    """Speed advice, for machines that shape the operator's command with it."""

    enabled: bool = Field(
        default=_ADVICE.enabled,
        description="True if advice is published: how much of each lever leaves the arm able to "
        "stop short of every zone. It costs some sweeps at each period.",
    )
    hold_s: Annotated[float, Field(ge=0.1, le=2.0)] = Field(
        default=_ADVICE.hold_s,
        description="How long a command may follow one advice [s]: it expires then. Longer is "
        "gentler, and slower near obstacles.",
    )
    period_s: Annotated[float, Field(ge=0.02, le=0.5)] = Field(
        default=_ADVICE.period_s, description="The time from one advice to the next [s]."
    )
    rise_per_s: Annotated[float, Field(gt=0.0, le=100.0)] = Field(
        default=_ADVICE.rise_per_s,
        description="How fast an advised share may rise [1/s]; it falls at once.",
    )


class NextModel(Model):
    """The forecast of what follows: how similar situations of the past went on."""

    enabled: bool = Field(
        default=_NEXT.enabled,
        description="True if similar situations of this operator and machine are remembered and "
        "asked; else only the motion under way speaks.",
    )
    horizon_s: Annotated[float, Field(ge=1.0, le=4.0)] = Field(
        default=_NEXT.horizon_s, description="How far ahead the forecast looks [s]."
    )
    analogues: Annotated[int, Field(ge=1, le=32)] = Field(
        default=_NEXT.analogues,
        description="The number of similar situations that are asked: the 8 of '6 of 8 times'.",
    )
    situations: Annotated[int, Field(ge=10_000, le=1_000_000)] = Field(
        default=_NEXT.situations,
        description="The number of situations that are remembered, the oldest go first; a day of "
        "work has about 200,000.",
    )


class SweepModel(Model):
    """Tolerances and budget of the certified sweep."""

    tolerance_m: _Tolerance = Field(
        default=_SWEEP.tolerance_m, description="The tolerance of a contact [m]."
    )
    clearance_tolerance_m: _Tolerance = Field(
        default=_SWEEP.clearance_tolerance_m,
        description="The tolerance of a reported clearance [m].",
    )
    max_queries: Annotated[int, Field(ge=10, le=10_000_000)] = Field(
        default=_SWEEP.max_queries,
        description="The largest number of clearance queries of one sweep.",
    )


class AlertsModel(Model):
    """When an alert is raised, held and given back."""

    imminent_probability: Annotated[float, Field(gt=0.0, lt=1.0)] = Field(
        default=_ALERTS.imminent_probability,
        description="The smallest probability of contact at which it is imminent that the arm, let "
        "go now, would still touch [-]; what no braking can avoid is imminent at any.",
    )
    warning_probability: Annotated[float, Field(gt=0.0, lt=1.0)] = Field(
        default=_ALERTS.warning_probability,
        description="The smallest probability of contact that warns [-]: 0.2 warns at 20 %, that "
        "is where one in five such situations ends in contact. Less warns earlier, and more "
        "often in vain.",
    )
    caution_probability: Annotated[float, Field(gt=0.0, lt=1.0)] = Field(
        default=_ALERTS.caution_probability,
        description="The smallest probability of contact that is a caution [-]; at most "
        "warning_probability.",
    )
    debounce_steps: _Steps = Field(
        default=_ALERTS.debounce_steps,
        description="The evaluations in a row before a caution or warning is published.",
    )
    imminent_steps: _Steps = Field(
        default=_ALERTS.imminent_steps,
        description="The evaluations in a row before an imminent alert is published.",
    )
    release_steps: _Steps = Field(
        default=_ALERTS.release_steps,
        description="The evaluations in a row without a cause before an alert goes.",
    )
    off_delay_s: Seconds = Field(
        default=_ALERTS.off_delay_s,
        description="The time a cause must be gone before its alert goes [s].",
    )
    min_on_s: Seconds = Field(
        default=_ALERTS.min_on_s, description="The shortest life of a published alert [s]."
    )
    deadband_m: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        default=_ALERTS.deadband_m,
        description="The extra clearance to regain before an alert goes [m].",
    )
    deadband_s: Seconds = Field(
        default=_ALERTS.deadband_s,
        description="The extra time to collision to regain before an alert goes [s].",
    )
    deadband_probability: Fraction = Field(
        default=_ALERTS.deadband_probability,
        description="The amount by which the probability must fall below the threshold [-].",
    )
    republish_s: Annotated[float, Field(ge=0.02, le=10.0)] = Field(
        default=_ALERTS.republish_s,
        description="The period of repeats while an alert is active [s].",
    )
    expires_after_s: Annotated[float, Field(gt=0.0, le=60.0)] = Field(
        default=_ALERTS.expires_after_s,
        description="The age at which a consumer must no longer trust an alert [s].",
    )
    horizon_s: Annotated[float, Field(gt=0.0, le=600.0)] = Field(
        default=_ALERTS.horizon_s,
        description="The time to contact beyond which an alert is a caution at most [s].",
    )
    realarm_s: Annotated[float, Field(ge=5.0, le=3600.0)] = Field(
        default=_ALERTS.realarm_s,
        description="The time after which an alert that goes on asks for attention again [s].",
    )
    shelve_max_s: Annotated[float, Field(gt=0.0, le=30.0)] = Field(
        default=_ALERTS.shelve_max_s,
        description="The longest time for which an alert may be shelved [s].",
    )


class JoystickInputModel(Model):
    """Supervision of the joystick messages."""

    timeout_s: _Timeout = Field(
        default=_INPUTS.joystick_timeout_s,
        description="The silence after which monitoring stops [s].",
    )
    on_change: bool = Field(
        default=_INPUTS.joystick_on_change,
        description="True if the joystick publishes only when it moves; alive_key is needed then.",
    )
    alive_key: Text | None = Field(
        default=None,
        description="The exact key of the publisher's liveliness token: its loss is silence.",
    )


class ActuatorsInputModel(Model):
    """Supervision of the actuator messages."""

    timeout_s: _Timeout = Field(
        default=_INPUTS.actuators_timeout_s,
        description="The silence after which monitoring stops [s].",
    )


class EnabledInputModel(Model):
    """Supervision of the enable key."""

    timeout_s: _Timeout = Field(
        default=2.0,
        description="The age at which the machine's word that it is off no longer holds [s].",
    )


class InputsModel(Model):
    """Limits of plausible input."""

    joystick: JoystickInputModel = Field(
        default=JoystickInputModel(), description="The supervision of the joystick messages."
    )
    actuators: ActuatorsInputModel = Field(
        default=ActuatorsInputModel(), description="The supervision of the actuator messages."
    )
    enabled: EnabledInputModel = Field(
        default=EnabledInputModel(), description="The supervision of the enable key."
    )
    position_slack: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        default=_INPUTS.position_slack,
        description="The amount a position may lie beyond its limits [share of range].",
    )
    speed_slack: Annotated[float, Field(ge=1.0, le=1000.0)] = Field(
        default=_INPUTS.speed_slack,
        description="The largest measured speed [multiples of max_velocity].",
    )
    max_stamp_jump_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=_INPUTS.max_stamp_jump_s,
        description="The largest step of a stamp beyond the time that really passed [s].",
    )
    max_clock_loss: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=_INPUTS.max_clock_loss,
        description="The time that stamps may lose on the true time before their messages count "
        "as late [s/s]; 1 for a simulation that may run slower than real time.",
    )
    max_rate_hz: Annotated[float, Field(ge=10.0, le=100_000.0)] = Field(
        default=_INPUTS.max_rate_hz,
        description="The messages of each input that are looked at [1/s]; of more, the newest "
        "are, and the status is degraded.",
    )
