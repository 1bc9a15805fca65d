"""The machine of a design, the limits of all its axes, and the peaks of its signals with all transients."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from annotated_types import Gt
from numpy.typing import ArrayLike, NDArray

from livebode.core import CHANNELS_MAX, UsageError, counted
from livebode.mimo.excitation import MatrixExcitation
from livebode.mimo.settings import MatrixLoop
from livebode.simulation import MotorLoop

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
_Positive = Annotated[float, Gt(0)]
_Each = _Positive | Sequence[_Positive]

_REPETITIONS = 2  # that are simulated from rest; later ones repeat the second


@dataclass(frozen=True, kw_only=True)
class MatrixLimits:
    """Limits of all axes at once, of the magnitude; one for all, or one for each motor or output. Default: none.

    Parameters
    ----------
    torque_n_m_max
        Of each motor, N m.
    current_a_max
        Of each motor, A; needs the torque constants.
    speed_max
        Of each output, in its unit.
    travel_max
        Of each output integrated over time from the place of rest, in its unit times s: rad, m.
    """

    torque_n_m_max: _Each | None = None
    current_a_max: _Each | None = None
    speed_max: _Each | None = None
    travel_max: _Each | None = None


@dataclass(frozen=True)
class Peak:
    """The largest magnitude of a signal over all experiments, with the transients between them, and its limit."""

    name: str
    unit: str
    size: float
    limit: float


@dataclass(frozen=True, kw_only=True)
class MatrixMachine:
    """A mechanism with its drives at standstill, and the noise that is measured.

    Parameters
    ----------
    loop
        Motors under their velocity controllers.
    noise
        Standard deviation of white noise on each output, in its unit; one for all, or one for each.
    torque_constant_n_m_per_a
        Of each motor; None: not known.

    Raises
    ------
    UsageError
        If the numbers do not fit the outputs or the motors, a value is not above 0, or the loop is not stable.
    """

    loop: MotorLoop
    noise: float | Sequence[float]
    torque_constant_n_m_per_a: float | Sequence[float] | None = None
    inputs: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(f"u{i + 1}" for i in range(self.loop.mechanism.motors)))
        self.deviation  # noqa: B018 - it is checked
        if not 2 <= len(self.inputs) <= CHANNELS_MAX:
            raise UsageError(
                "out-of-range",
                f"the machine has {counted(len(self.inputs), 'motor')}, and experiments separate 2 to {CHANNELS_MAX}",
                "describe one motor as [belt], or use [measured]",
                argument="input_shapes",
            )
        if not self.loop.decay < 1:
            raise UsageError(
                "out-of-range",
                "the loop of the described machine is not stable: a motion of it grows from tick to tick",
                "correct the gains of the drives or the description",
                argument="gain_n_m_s",
            )

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Names and units."""
        return self.loop.mechanism.outputs

    @property
    def deviation(self) -> Floats:
        """Of the noise, shape (outputs,)."""
        return _each(self.noise, len(self.outputs), "noise", "output")

    @property
    def described(self) -> MatrixLoop:
        """The controllers for the estimators."""
        motors, outputs = len(self.inputs), len(self.outputs)
        rows = [[None] * i + [pid] + [None] * (outputs - i - 1) for i, pid in enumerate(self.loop.controllers)]
        assert len(rows) == motors
        return MatrixLoop(feedback=rows)

    def response(self, frequency_hz: ArrayLike) -> Complex:
        """Of the plant, shape (lines, outputs, inputs)."""
        return self.loop.mechanism.response(frequency_hz, self.loop.rate_hz)

    def check(self, limits: MatrixLimits) -> None:
        """UsageError for limits that do not fit the machine, or if there are none."""
        if not list(self._limited(limits)):
            raise UsageError(
                "missing",
                "there are no limits, so that no amplitude can be chosen",
                "give torque_n_m_max, current_a_max, speed_max or travel_max",
                argument="torque_n_m_max",
            )

    def unit_signals(self, excitation: MatrixExcitation, limits: MatrixLimits) -> tuple[Floats, list[Peak]]:
        """The limited signals as a share of their limits, from rest, shape (signals, samples, inputs).

        The last axis has the part of each input's excitation alone: the loop is linear. With their names and limits.
        """
        motors = len(self.inputs)
        once = np.tile(excitation.samples, _REPETITIONS)
        inputs = np.zeros((2 * motors + len(self.outputs), once.shape[1], motors))
        inputs[range(motors), :, range(motors)] = once
        signals, travels = self.loop.signals(inputs)[motors:], self.loop.travels(inputs)
        rows = np.concatenate([signals, travels])
        shares, peaks = [], []
        for name, unit, row, limit in self._limited(limits):
            shares.append(rows[row] / limit)
            peaks.append(Peak(name, unit, 0.0, limit))
        return np.stack(shares), peaks

    def _limited(self, limits: MatrixLimits) -> Iterator[tuple[str, str, int, float]]:
        """Name, unit, row among torques, outputs and travels, and limit."""
        motors, outputs = len(self.inputs), len(self.outputs)
        torque = np.full(motors, np.inf)
        names = [f"torque of motor {i + 1}" for i in range(motors)]
        if limits.torque_n_m_max is not None:
            torque = _each(limits.torque_n_m_max, motors, "torque_n_m_max", "motor")
        if limits.current_a_max is not None:
            allowed = self._constant() * _each(limits.current_a_max, motors, "current_a_max", "motor")
            for i in np.flatnonzero(allowed < torque).tolist():
                names[i] = f"torque of motor {i + 1}, by its current"
            torque = np.minimum(torque, allowed)
        for i in range(motors):
            if np.isfinite(torque[i]):
                yield names[i], "N m", i, float(torque[i])
        for given, name, word, first in (
            (limits.speed_max, "speed_max", "speed", motors),
            (limits.travel_max, "travel_max", "travel", motors + outputs),
        ):
            if given is not None:
                for o, limit in enumerate(_each(given, outputs, name, "output")):
                    channel, unit = self.outputs[o]
                    shown = unit if word == "speed" else unit.removesuffix("/s")
                    yield f"{word} of {channel}", shown, first + o, float(limit)

    def _constant(self) -> Floats:
        if self.torque_constant_n_m_per_a is None:
            raise UsageError(
                "missing",
                "current_a_max limits the current, but the torque constants are missing",
                "give torque_constant_n_m_per_a, or torque_n_m_max instead",
                argument="torque_constant_n_m_per_a",
            )
        return _each(self.torque_constant_n_m_per_a, len(self.inputs), "torque_constant_n_m_per_a", "motor")


def _each(value: float | Sequence[float], count: int, name: str, whose: str) -> Floats:
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in ((), (count,)):
        raise UsageError(
            "wrong-shape",
            f"{name} has {given.size} values for {count} {whose}s",
            f"give one, or one for each {whose}",
            argument=name,
            shape=list(given.shape),
        )
    if not np.all(np.isfinite(given) & (given > 0)):
        raise UsageError(
            "out-of-range",
            f"{name}={value} is not finite and above 0",
            "correct it",
            argument=name,
            value=value,
        )
    return np.broadcast_to(given, (count,))
