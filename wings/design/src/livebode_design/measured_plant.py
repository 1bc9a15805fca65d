"""The Machine of a measured plant or of a plant model."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import (
    Algebra,
    DesignError,
    Gain,
    GridError,
    Loop,
    Model,
    Responses,
    SignalError,
    UsageError,
    as_model,
    integral,
)
from livebode.dataclass import dataclass
from livebode_design.machine import STANDSTILL, Extremes, Machine, OperatingPoint, within

Output = Literal["velocity", "position"]


@dataclass(frozen=True, eq=False)
class MeasuredResponse(Algebra):
    """A measured response as a Model: exact at its lines, between them interpolated in log-magnitude and phase.

    Beyond its first and last line it raises an error.

    >>> plant = MeasuredResponse(np.array([10.0, 40.0]), np.array([4.0 + 0j, 1.0 + 0j]))
    >>> float(abs(plant.response(20.0)).round(6))
    2.0
    """

    frequency_hz: Floats
    value: Complex

    @classmethod
    def of(cls, responses: Responses) -> MeasuredResponse:
        """From one response, at its valid lines; SignalError where fewer than two are valid."""
        if responses.quantity != "plant":
            raise SignalError(
                "wrong-quantity",
                f"these are responses of the {responses.quantity}",
                "use those of the plant",
                quantity=responses.quantity,
                allowed=["plant"],
            )
        valid = responses.valid[0] & np.isfinite(responses.value[0])
        if np.sum(valid) < 2:
            raise SignalError(
                "too-few-lines",
                f"the response is valid at {np.sum(valid)} lines; at least two are needed",
                "measure more lines, or raise the amplitude",
                lines=int(np.sum(valid)),
                lines_min=2,
            )
        return cls(responses.lines.frequency_hz[valid], responses.value[0, valid])

    @property
    def band_hz(self) -> tuple[float, float]:
        """From its first line to its last."""
        return float(self.frequency_hz[0]), float(self.frequency_hz[-1])

    def response(self, frequency_hz: ArrayLike) -> Complex:
        f = np.asarray(frequency_hz, dtype=np.float64)
        outside = ~within(f, self.band_hz)
        if np.any(outside):
            raise GridError(
                "line-off",
                f"{float(f[outside].flat[0]):g} Hz is outside {self.band_hz[0]:g} … {self.band_hz[1]:g} "
                "Hz, where the response was measured",
                "choose lines within, or measure further",
                frequency_hz=float(f[outside].flat[0]),
                band_hz=list(self.band_hz),
            )
        # Over ln f a straight part of the Bode plot is interpolated exactly.
        log_f, known = np.log(f), np.log(self.frequency_hz)
        logarithm = np.log(np.abs(self.value)) + 1j * np.unwrap(np.angle(self.value))
        return np.asarray(np.exp(np.interp(log_f, known, logarithm)), dtype=np.complex128)


@dataclass(frozen=True)
class _Integral(Algebra):
    """The trapezoidal integral of a sampled output."""

    plant: Model
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Complex:
        f = np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(self.plant.response(f) * integral(f, self.rate_hz, "trapezoidal"))


@dataclass(frozen=True)
class _Derivative(Algebra):
    plant: Model

    def response(self, frequency_hz: ArrayLike) -> Complex:
        f = np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(self.plant.response(f) * (2j * np.pi * f))


def measured_machine(
    plant: object,
    loop: Loop,
    rate_hz: float,
    *,
    output: Output = "velocity",
    radius_m: float = 1.0,
    noise: float = 0.0,
    motion: Extremes | None = None,
    stroke_s: float | None = None,
    notes: tuple[str, ...] = (),
    encoder_counts_per_turn: int = 0,
) -> Machine:
    """The Machine around a plant with a known response, at one place.

    Parameters
    ----------
    plant
        From torque, N m, to the measured output: a Model (a `Fit`, a `MeasuredResponse`) or a python-control system.
    loop
        Its loop, with the feedback from this output, and an excitation that is a torque.
    rate_hz
        Ticks of the drive per second.
    output
        Whether the output is the motor's velocity, rad/s, or position, rad.
    radius_m
        Metres of travel per radian; omit it for a rotary axis, whose metres are then radians.
    noise
        Standard deviation of white noise on the output, in its unit.
    motion
        Lowest and highest value of each quantity in the motion alone. An omitted quantity is not known and cannot be
        limited; but an axis at standstill has no speed and no following error, and its default torque is zero.
    stroke_s
        Seconds in which the motion passes each place once; None for an axis at standstill.
    notes
        For `Machine.notes`.
    encoder_counts_per_turn
        Of the motor's encoder; 0 where it is not known.

    The load is assumed to follow the motor: above the first antiresonance its travel differs.

    Raises
    ------
    LivebodeError
        If the plant has no response, the loop no feedback, the output is not supported, a range of the motion is
        invalid, or an axis without stroke_s moves.
    """
    given = as_model(plant)
    if loop.feedback is None:
        raise DesignError("feedback-unknown", "the loop's feedback is missing", "describe its controllers")
    if output not in ("velocity", "position"):
        raise UsageError(
            "not-one-of",
            f"{output=} is not one of 'velocity', 'position'",
            "choose one of them",
            argument="output",
            value=output,
            allowed=["velocity", "position"],
        )
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise UsageError(
            "out-of-range",
            f"{radius_m=} is not a finite number above 0",
            "leave it out for a rotary axis",
            argument="radius_m",
            value=radius_m,
        )
    way = Gain(radius_m) * (_Integral(given, rate_hz) if output == "velocity" else given)
    speed = Gain(radius_m) * (given if output == "velocity" else _Derivative(given))
    own = _motion(motion or {}, stroke_s)
    band_hz = given.band_hz if isinstance(given, MeasuredResponse) else None
    place = OperatingPoint(plant=given, speed=speed, travel=way, angle=way, motion=own, name="as measured")
    step_m = 2 * np.pi * radius_m / encoder_counts_per_turn if encoder_counts_per_turn > 0 else 0.0
    return Machine(
        places=(place,), loop=loop, rate_hz=rate_hz, noise=noise, stroke_s=stroke_s, notes=notes, band_hz=band_hz,
        encoder_step_m=step_m, slowest_m_per_s=_slowest(own) if stroke_s is not None else None,
    )  # fmt: skip


def _slowest(motion: Extremes) -> float | None:
    """Speed of the slower one of both directions, None where it is not known."""
    return min((abs(speed) for speed in motion.get("speed", ()) if speed), default=None)


def _motion(given: Extremes, stroke_s: float | None) -> Extremes:
    """Ranges of the motion, completed for an axis at standstill."""
    for name, (low, high) in given.items():
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise UsageError(
                "out-of-range",
                f"the {name} of the motion, [{low}, {high}], is not a lowest and a highest value",
                "specify two finite numbers, the lower one first",
                argument="motion",
                quantity=name,
                value=[low, high],
            )
    if stroke_s is not None:
        if not (np.isfinite(stroke_s) and stroke_s > 0):
            raise UsageError(
                "out-of-range",
                f"{stroke_s=} is not a finite number above 0",
                "leave it out for an axis at standstill",
                argument="stroke_s",
                value=stroke_s,
            )
        return given
    low, high = given.get("speed", (0.0, 0.0))
    if low != high:
        raise UsageError(
            "missing",
            f"the motion has a speed of {low:g} … {high:g} m/s, but no stroke_s",
            "specify the seconds in which it passes each place once",
            argument="stroke_s",
            speed_m_per_s=[low, high],
        )
    return STANDSTILL | given
