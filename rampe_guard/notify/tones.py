"""Sounds of the levels, made here: one period of each pattern as samples and as a WAV file."""

from __future__ import annotations

import wave
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

RATE_HZ = 22_050
_LOUD = 0.7
_FADE_S = 0.005
"""Rise and fall of a tone: without it, it clicks."""


@dataclass(frozen=True, slots=True)
class Tone:
    """What is played again and again while something asks for attention.

    Attributes:
        name: for people and file names.
        grave: the graver interrupts the others.
        period_s: from one playing to the next [s].
        beeps: start [s], length [s] and frequency [Hz] of each beep in it.
    """

    name: str
    grave: int
    period_s: float
    beeps: tuple[tuple[float, float, float], ...]


IMMINENT = Tone("imminent", 3, 1.0, tuple((0.25 * i, 0.13, 1760.0) for i in range(4)))
WARNING = Tone("warning", 2, 2.0, ((0.0, 0.25, 880.0), (0.3, 0.25, 660.0)))
UNPROTECTED = Tone("unprotected", 1, 2.0, ((0.0, 0.35, 440.0), (0.4, 0.35, 330.0)))
TONES = (IMMINENT, WARNING, UNPROTECTED)


def samples(tone: Tone) -> npt.NDArray[np.int16]:
    """One period, without the silence after its last beep, at `RATE_HZ` (n,)."""
    length_s = max(start + length for start, length, _ in tone.beeps)
    sound = np.zeros(round(length_s * RATE_HZ))
    for start_s, beep_s, frequency_hz in tone.beeps:
        time_s = np.arange(round(beep_s * RATE_HZ)) / RATE_HZ
        edge = np.minimum(time_s, beep_s - time_s) / _FADE_S
        first = round(start_s * RATE_HZ)
        beep = np.sin(2.0 * np.pi * frequency_hz * time_s) * np.clip(edge, 0.0, 1.0)
        sound[first : first + len(beep)] = beep[: len(sound) - first]
    return np.asarray(_LOUD * 32767.0 * sound, dtype="<i2")


def write(tone: Tone, folder: Path) -> Path:
    """Write it as ``NAME.wav``: 16 bit, one channel."""
    path = folder / f"{tone.name}.wav"
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(RATE_HZ)
        out.writeframes(samples(tone).tobytes())
    return path
