"""All that a page shows of one machine at one time, as plain values.

Poses are 4x4 matrices in the world [m]. Texts are for people, and not yet escaped.
"""

from __future__ import annotations

from dataclasses import dataclass

from rampe_guard.core.types import FloatArray, Point
from rampe_guard.dashboard.tones import Tone


@dataclass(frozen=True, slots=True)
class Banner:
    """What must be read from three metres away.

    Attributes:
        tone: of all of it.
        word: what it is, in one or two words.
        text: the most urgent thing.
        count: time to the collision, or empty.
        detail: a smaller line.
        flash: its shape flashes: nobody has acknowledged it.
    """

    tone: Tone
    word: str
    text: str
    count: str = ""
    detail: str = ""
    flash: bool = False


@dataclass(frozen=True, slots=True)
class Zone:
    """A keep-out object, or an actuator limit, which is shown as text alone.

    Attributes:
        name: of the zone.
        tone: how urgent its alert is.
        lit: the bright half of its pulse is on.
        label: what is written at it.
        known: it is known where it is.
        pose: of a moving object; None while nobody knows, and for all others.
    """

    name: str
    tone: Tone
    lit: bool
    label: str
    known: bool = True
    pose: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Contact:
    """Where the first contact will be."""

    point: Point
    tone: Tone
    lit: bool
    label: str


@dataclass(frozen=True, slots=True)
class Bar:
    """One actuator: shares are of its drawn travel, from 0 to 1.

    Attributes:
        name: of the actuator.
        here: where it is; None = unknown or stale.
        there: where it is expected to end; None = no prediction.
        near: least expected end, one spread short; None = no spread.
        far: one spread further.
        barred: stretches of travel that are keep-out zones, with their tones.
        value: position in words.
        expected: predicted displacement and its spread in words.
        lever: in words.
    """

    name: str
    here: float | None
    there: float | None
    near: float | None
    far: float | None
    barred: tuple[tuple[float, float, Tone], ...]
    value: str
    expected: str
    lever: str


@dataclass(frozen=True, slots=True)
class Card:
    """One alert.

    Attributes:
        alert_id: what to acknowledge or shelve.
        tone: how urgent.
        title: which link and zone.
        count: time to the collision, or empty.
        detail: where it stands, who has seen it, how near.
        flash: nobody has acknowledged it.
        can_ack: it waits for that.
        can_shelve: it may be put aside for a time.
        shelved: it is.
    """

    alert_id: str
    tone: Tone
    title: str
    count: str
    detail: str
    flash: bool
    can_ack: bool
    can_shelve: bool
    shelved: bool


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at ``at_s`` on the viewer's clock [s]."""

    at_s: float
    tone: Tone
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """The page.

    Attributes:
        machine: its name.
        site: its name.
        now_s: time of the picture [s].
        banner: across the top.
        lost: nobody watches over the machine: nothing may look as if it were judged.
        zones: keep-out objects with a body, in the model's order.
        limits: actuator limits.
        links: poses of the arm (L, 4, 4); None = never heard where it is.
        stale: those poses are old.
        link_tones: how urgent the alerts are that name a link (L,).
        intent: ghosts on the way to the predicted end (k, L, 4, 4), or None.
        stopping: ghosts on the stopping path (k, L, 4, 4), or None.
        next: ghost where the likeliest way on from memory leads (1, L, 4, 4), or None.
        next_words: how often it did.
        contact: of the most urgent alert that knows it.
        bars: actuators.
        basis: what the prediction rests on.
        cards: alerts, the gravest first.
        events: newest first.
        leads: newest warnings that came true, with the time that they gave.
        footer: health in one line.
    """

    machine: str
    site: str
    now_s: float
    banner: Banner
    lost: bool
    zones: tuple[Zone, ...]
    limits: tuple[Zone, ...]
    links: FloatArray | None
    stale: bool
    link_tones: tuple[Tone, ...]
    intent: FloatArray | None
    stopping: FloatArray | None
    next: FloatArray | None
    next_words: str
    contact: Contact | None
    bars: tuple[Bar, ...]
    basis: str
    cards: tuple[Card, ...]
    events: tuple[Event, ...]
    leads: tuple[str, ...]
    footer: str
