"""Machine: what an excitation does to an axis in its loop, place by place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import Loop, Model, UsageError

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Quantity = Literal["torque", "speed", "travel", "following error"]
QUANTITIES: tuple[Quantity, ...] = ("torque", "speed", "travel", "following error")
UNITS: Mapping[Quantity, str] = {"torque": "N m", "speed": "m/s", "travel": "m", "following error": "m"}
MOTION_KEYS: Mapping[Quantity, str] = {
    "torque": "torque_n_m",
    "speed": "speed_m_per_s",
    "travel": "position_m",
    "following error": "following_error_m",
}
"""Under which key a file has the extremes of each in the motion alone."""
Extremes = dict[Quantity, tuple[float, float]]
"""Lowest and highest value of each quantity."""
STANDING: Extremes = {"torque": (0.0, 0.0), "speed": (0.0, 0.0), "following error": (0.0, 0.0)}
"""What an axis does that stands, nobody says where."""

_EDGE = 1e-9  # of a frequency: a line at the end of the band is inside
_NOISE_MIN, _NOISE_MAX = 1e-15, 1e9  # beyond them is a slip of the pen


def within(frequency_hz: ArrayLike, band_hz: tuple[float, float]) -> NDArray[np.bool_]:
    """Which frequencies lie in a band, its ends included."""
    f = np.asarray(frequency_hz)
    return np.asarray((f >= band_hz[0] * (1 - _EDGE)) & (f <= band_hz[1] * (1 + _EDGE)))


def check_noise(noise: float) -> None:
    """UsageError where no output has noise of this standard deviation."""
    if not (noise == 0 or _NOISE_MIN <= noise <= _NOISE_MAX):
        raise UsageError(
            "out-of-range",
            f"noise={noise} is not 0 or from {_NOISE_MIN:g} to {_NOISE_MAX:g}",
            "give its standard deviation",
            argument="noise",
            value=noise,
        )


@dataclass(frozen=True, eq=False)
class Place:
    """The linear machine at one place of its way, sampled behind the hold of its drive.

    Parameters
    ----------
    plant
        From torque to the measured output.
    speed, travel, angle
        From torque to the belt's speed at the motor, m/s, the load's position, m, and the motor's position, m.
    motion
        What the motion alone does near this place; a quantity that is left out is not known.
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
    """An axis in its loop, as far as an experiment has to know it.

    Parameters
    ----------
    places
        One for an axis that stands, several along the way of one that moves.
    loop
        u = E·w − F·y.
    rate_hz
        Ticks of the drive per second.
    noise
        Standard deviation of white noise on the measured output, in its unit; 0 where it is not known.
    stroke_s
        Seconds in which the motion passes each place once; None for an axis that stands.
    notes
        What the prediction leaves out, in sentences.
    band_hz
        Where the responses are known; None everywhere.
    encoder_step_m
        Way of the motor from one count of its encoder to the next; 0 where it is not known.
    """

    places: tuple[Place, ...]
    loop: Loop
    rate_hz: float
    noise: float = 0.0
    stroke_s: float | None = None
    notes: tuple[str, ...] = ()
    band_hz: tuple[float, float] | None = None
    encoder_step_m: float = 0.0

    def __post_init__(self) -> None:
        if not self.places:
            raise UsageError(
                "missing", "the machine has no place", "describe it at one place at least", argument="places"
            )
        if not (np.isfinite(self.encoder_step_m) and self.encoder_step_m >= 0):
            raise UsageError(
                "out-of-range",
                f"encoder_step_m={self.encoder_step_m} is not a finite number of at least 0",
                "give metres, 0 for no encoder",
                argument="encoder_step_m",
                value=self.encoder_step_m,
            )
        check_noise(self.noise)

    def torque(self, place: Place, frequency_hz: Floats) -> Complex:
        """U/W = E/(1 + G·F) at one place."""
        feedback = self.loop.feedback_at(frequency_hz)
        return self.loop.entry_at(frequency_hz) / (1 + place.plant.response(frequency_hz) * feedback)

    def responses(self, place: Place, frequency_hz: Floats) -> dict[Quantity, Complex]:
        """From the excitation to each quantity, per N m; frequencies above 0."""
        torque = self.torque(place, frequency_hz)
        return {
            "torque": torque,
            "speed": torque * place.speed.response(frequency_hz),
            "travel": torque * place.travel.response(frequency_hz),
            "following error": -torque * place.angle.response(frequency_hz),
        }
