"""The machine of a design by its equations of motion: with all transients."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import CHANNELS_MAX, MatrixLoop, UsageError, counted
from livebode.dataclass import dataclass
from livebode.excitation import MatrixExcitation
from livebode.simulation import MotorLoop
from livebode_design.matrix.machine import MatrixMachine, each_of

_REPETITIONS = 2  # that are simulated from rest; later ones repeat the second


@dataclass(frozen=True, kw_only=True)
class MechanismMachine(MatrixMachine):
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

    @np.errstate(all="ignore")  # numbers that are not finite are found
    def __post_init__(self) -> None:
        each_of(self.noise, len(self.outputs), "noise", "output")
        if not 2 <= len(self.inputs) <= CHANNELS_MAX:
            raise UsageError(
                "out-of-range",
                f"the machine has {counted(len(self.inputs), 'motor')}, and experiments separate 2 to {CHANNELS_MAX}",
                "describe one motor as [belt]",
                argument="input_shapes",
            )
        finite = all(np.isfinite(matrix).all() for matrix in (*self.loop.mechanism.state_space, *self.loop.matrices))
        if not finite or not np.any(self.response([1.0])):
            raise UsageError(
                "out-of-range",
                "a value of the described machine or its drives is not finite, or too large or small to compute with",
                "correct it",
                argument="loop",
            )
        if not self.loop.decay < 1:
            raise UsageError(
                "out-of-range",
                "the loop of the described machine is not stable: a motion of it grows from tick to tick",
                "correct the gains of the drives or the description",
                argument="gain_n_m_s",
            )

    @property
    def rate_hz(self) -> float:
        """Rate of the drives."""
        return self.loop.rate_hz

    @property
    def inputs(self) -> tuple[str, ...]:
        """u1, u2, …"""
        return tuple(f"u{i + 1}" for i in range(self.loop.mechanism.motors))

    @property
    def excitations(self) -> tuple[str, ...]:
        """w1, w2, …"""
        return tuple(f"w{i + 1}" for i in range(self.loop.mechanism.motors))

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the outputs."""
        return self.loop.mechanism.outputs

    @property
    def described(self) -> MatrixLoop:
        """The controller of each motor."""
        outputs = len(self.outputs)
        rows = [[None] * i + [pid] + [None] * (outputs - i - 1) for i, pid in enumerate(self.loop.controllers)]
        return MatrixLoop(feedback=rows)

    def response(self, frequency_hz: ArrayLike) -> Complex:
        """Response of the plant, shape (lines, outputs, inputs)."""
        return self.loop.mechanism.response(frequency_hz, self.loop.rate_hz)

    def deviation(self, frequency_hz: ArrayLike) -> Floats:
        """Deviation of the noise, the same at each line."""
        each = each_of(self.noise, len(self.outputs), "noise", "output")
        return np.broadcast_to(each, (np.size(frequency_hz), len(each)))

    def settle_periods(self, excitation: MatrixExcitation, below: Floats) -> int:
        """By the slowest mode, from the largest magnitude of each output."""
        outputs = self.loop.signals(self.loop.inputs(excitation.samples))[2 * len(self.inputs) :]
        remaining = float((below / np.abs(outputs).max(axis=1)).min())
        return 1 if remaining >= 1 else self.loop.settle_periods(excitation.lines.window, remaining)

    @property
    def settle_reason(self) -> str:
        """The slowest mode."""
        half_ms = 1000 * np.log(0.5) / np.log(self.loop.decay) / self.rate_hz
        return f"the slowest mode halves in {half_ms:.3g} ms; it decays well below the noise of a line"

    @property
    def peaks_include(self) -> str:
        """All transients."""
        return "with all transients, from rest"

    def unit_rows(self, excitation: MatrixExcitation) -> Floats:
        """From rest through two repetitions."""
        motors = len(self.inputs)
        once = np.tile(excitation.samples, _REPETITIONS)
        inputs = np.zeros((2 * motors + len(self.outputs), once.shape[1], motors))
        inputs[range(motors), :, range(motors)] = once
        return np.concatenate([self.loop.signals(inputs)[motors:], self.loop.travels(inputs)])
