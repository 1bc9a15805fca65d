"""Machine: the effect of an excitation on an axis in its loop, at each place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Loop, Model, UsageError
from livebode.dataclass import dataclass

Quantity = Literal["torque", "speed", "travel", "following error"]
QUANTITIES: tuple[Quantity, ...] = ("torque", "speed", "travel", "following error")
UNITS: Mapping[Quantity, str] = {"torque": "N m", "speed": "m/s", "travel": "m", "following error": "m"}
MOTION_KEYS: Mapping[Quantity, str] = {
    "torque": "torque_n_m",
    "speed": "speed_m_per_s",
    "travel": "position_m",
    "following error": "following_error_m",
}
"""Key of a file with the extremes of each quantity in the motion alone."""
Extremes = dict[Quantity, tuple[float, float]]
"""Lowest and highest value of each quantity."""
STANDSTILL: Extremes = {"torque": (0.0, 0.0), "speed": (0.0, 0.0), "following error": (0.0, 0.0)}
"""Motion of an axis at standstill at an unknown position."""

_EDGE = 1e-9  # of a frequency: a line at the end of the band is inside
_NOISE_MIN, _NOISE_MAX = 1e-15, 1e9  # values outside are typing errors


def within(frequency_hz: ArrayLike, band_hz: tuple[float, float]) -> NDArray[np.bool_]:
    """Frequencies within a band, ends included."""
    f = np.asarray(frequency_hz)
    return np.asarray((f >= band_hz[0] * (1 - _EDGE)) & (f <= band_hz[1] * (1 + _EDGE)))


def check_noise(noise: float) -> None:
    """Raise UsageError for a standard deviation that no output has."""
    if not (noise == 0 or _NOISE_MIN <= noise <= _NOISE_MAX):
        raise UsageError(
            "out-of-range",
            f"noise={noise} is not 0 or from {_NOISE_MIN:g} to {_NOISE_MAX:g}",
            "specify its standard deviation",
            argument="noise",
            value=noise,
        )


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """The linear machine at one place of its travel, sampled behind the hold of its drive.

    Parameters
    ----------
    plant
        From torque to the measured output.
    speed, travel, angle
        From torque to the belt's speed at the motor, m/s, the load's position, m, and the motor's position, m.
    motion
        Ranges in the motion alone near this place; an omitted quantity is not known.
    name
        In words.
    """

    plant: Model
    speed: Model
    travel: Model
    angle: Model
    motion: Extremes = field(default_factory=dict)
    name: str = ""


@dataclass(frozen=True, eq=False)
class Machine:
    """The description of an axis in its loop that an experiment needs.

    Parameters
    ----------
    places
        One for an axis at standstill, several along the travel of a moving one.
    loop
        u = E·w − F·y.
    rate_hz
        Ticks of the drive per second.
    noise
        Standard deviation of white noise on the measured output, in its unit; 0 where it is not known.
    stroke_s
        Seconds in which the motion passes each place once; None for an axis at standstill.
    notes
        Effects that the prediction does not include, as sentences.
    band_hz
        Band in which the responses are known; None: everywhere.
    encoder_step_m
        Travel of the motor per count of its encoder; 0 where it is not known.
    slowest_m_per_s
        Speed of the slowest stroke of the motion; None at standstill or where it is not known.
    """

    places: tuple[OperatingPoint, ...]
    loop: Loop
    rate_hz: float
    noise: float = 0.0
    stroke_s: float | None = None
    notes: tuple[str, ...] = ()
    band_hz: tuple[float, float] | None = None
    encoder_step_m: float = 0.0
    slowest_m_per_s: float | None = None

    def __post_init__(self) -> None:
        if not self.places:
            raise UsageError(
                "missing", "the machine has no place", "describe it at one or more places", argument="places"
            )
        if not (np.isfinite(self.encoder_step_m) and self.encoder_step_m >= 0):
            raise UsageError(
                "out-of-range",
                f"encoder_step_m={self.encoder_step_m} is not a finite number of at least 0",
                "specify metres, 0 for no encoder",
                argument="encoder_step_m",
                value=self.encoder_step_m,
            )
        check_noise(self.noise)

    def torque(self, place: OperatingPoint, frequency_hz: Floats) -> Complex:
        """U/W = E/(1 + G·F) at one place."""
        feedback = self.loop.feedback_at(frequency_hz)
        return self.loop.entry_at(frequency_hz) / (1 + place.plant.response(frequency_hz) * feedback)

    def responses(self, place: OperatingPoint, frequency_hz: Floats) -> dict[Quantity, Complex]:
        """From the excitation to each quantity, per N m; frequencies above 0."""
        torque = self.torque(place, frequency_hz)
        return {
            "torque": torque,
            "speed": torque * place.speed.response(frequency_hz),
            "travel": torque * place.travel.response(frequency_hz),
            "following error": -torque * place.angle.response(frequency_hz),
        }
