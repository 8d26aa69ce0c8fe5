"""What is known of one machine at one time: the newest of everything that was heard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rampe_guard import wire
from rampe_guard.client.machine import MachineState
from rampe_guard.core.types import FloatArray
from rampe_guard.dashboard.picture import Event

STALE_S = 1.0
"""Age from which a position or a lever is no longer shown as present [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Times are on the viewer's monotonic clock.

    Attributes:
        guard: what its guard says, or that it says nothing.
        now_s: now [s].
        trouble: why nothing can be heard (no router, say); empty if the way is open.
        other_scene: why the scene that is drawn is not the guard's; empty if it is.
        position: newest (n,) [unit]; None before the first.
        position_s: when it came [s].
        velocity: (n,) [unit/s].
        command: levers in the actuators' direction (n,) in [-1, 1]; None before the first.
        command_s: when they came [s].
        prediction: of the primitive under way; None between primitives.
        placed: where moving objects are, by zone (4, 4) [m].
        placed_s: when that came [s].
        events: newest first.
        leads: newest first.
    """

    guard: MachineState
    now_s: float
    trouble: str = ""
    other_scene: str = ""
    position: FloatArray | None = None
    position_s: float = 0.0
    velocity: FloatArray | None = None
    command: FloatArray | None = None
    command_s: float = 0.0
    prediction: wire.Prediction | None = None
    placed: Mapping[str, FloatArray] = field(default_factory=dict)
    placed_s: Mapping[str, float] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    leads: tuple[str, ...] = ()

    @property
    def position_stale(self) -> bool:
        """Positions are missing, or too old to be shown as present."""
        return self.position is None or self.now_s - self.position_s > STALE_S

    @property
    def command_stale(self) -> bool:
        """The same of the levers."""
        return self.command is None or self.now_s - self.command_s > STALE_S
