"""The machine of a design by its measured matrix of responses: in the periodic state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Lines, MatrixLoop, UsageError
from livebode.dataclass import dataclass
from livebode.excitation import MatrixExcitation
from livebode_design.matrix.machine import MatrixMachine


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredMachine(MatrixMachine):
    """A matrix of responses with its noise, as measured, and the controllers. Transients are not known.

    Parameters
    ----------
    lines
        Where it is known.
    value, noise_deviation
        Responses (lines, outputs, inputs), and standard deviation of the noise as if it were white (lines, outputs).
    names
        Of inputs and excitations.
    output_units
        Names and units of the outputs.
    loop
        The controllers.
    settle
        Periods for the transient, as in the measurement.
    torque_constant_n_m_per_a
        Of each motor; None: not known.
    """

    lines: Lines
    value: Complex
    noise_deviation: Floats
    names: tuple[tuple[str, ...], tuple[str, ...]]
    output_units: tuple[tuple[str, str], ...]
    loop: MatrixLoop
    settle: int
    torque_constant_n_m_per_a: float | Sequence[float] | None = None

    @property
    def rate_hz(self) -> float:
        """Rate of the measurement."""
        return self.lines.rate_hz

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs of the measurement."""
        return self.names[0]

    @property
    def excitations(self) -> tuple[str, ...]:
        """Excitations of the measurement."""
        return self.names[1]

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the outputs."""
        return self.output_units

    @property
    def described(self) -> MatrixLoop:
        """The controllers."""
        return self.loop

    def response(self, frequency_hz: ArrayLike) -> Complex:
        """Response at lines of the measurement; UsageError at others."""
        return self.value[self._at(frequency_hz)]

    def deviation(self, frequency_hz: ArrayLike) -> Floats:
        """Deviation of the noise at lines of the measurement; UsageError at others."""
        return self.noise_deviation[self._at(frequency_hz)]

    def settle_periods(self, excitation: MatrixExcitation, _below: Floats) -> int:
        """Periods until a transient has decayed: as long as in the measurement."""
        return int(np.ceil(self.settle * self.lines.window / excitation.lines.window))

    @property
    def settle_reason(self) -> str:
        """The measurement."""
        return "as long as in the run"

    @property
    def peaks_include(self) -> str:
        """No transients."""
        return "in the periodic state: the transients of a measured machine are not known"

    def unit_rows(self, excitation: MatrixExcitation) -> Floats:
        """One period of each experiment."""
        lines = excitation.lines
        response = self.response(lines.frequency_hz)
        inner = np.eye(len(self.inputs)) + self.loop.feedback_at(lines.frequency_hz) @ response
        alone = excitation.spectra.transpose(2, 1, 0)[:, :, :, None] * np.eye(len(self.inputs))[:, None, :]
        flat = alone.reshape(len(lines), len(self.inputs), -1)  # (lines, inputs, experiments × inputs)
        torques = np.linalg.solve(inner, flat)
        outputs = response @ torques
        travels = outputs / (2j * np.pi * lines.frequency_hz[:, None, None])
        spectra = np.concatenate([torques, outputs, travels], axis=1)
        full = np.zeros((lines.window // 2 + 1, *spectra.shape[1:]), dtype=np.complex128)
        full[list(lines.bins)] = spectra * lines.window / 2j
        signals = np.fft.irfft(full, lines.window, axis=0)  # (samples, signals, experiments × inputs)
        apart = signals.reshape(lines.window, signals.shape[1], -1, len(self.inputs))
        return apart.transpose(1, 2, 0, 3).reshape(signals.shape[1], -1, len(self.inputs))

    def _at(self, frequency_hz: ArrayLike) -> NDArray[np.intp]:
        asked = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        known = self.lines.frequency_hz
        nearest = np.abs(asked[:, None] - known).argmin(axis=1)
        off = np.abs(known[nearest] - asked) > 1e-9 * asked
        if off.any():
            raise UsageError(
                "out-of-range",
                f"the run has no response at {asked[off][0]:g} Hz",
                f"choose among its lines, {known[0]:g} … {known[-1]:g} Hz",
                argument="lines",
                frequency_hz=float(asked[off][0]),
            )
        return np.asarray(nearest, dtype=np.intp)
