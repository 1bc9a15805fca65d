"""MatrixDesign: the chosen experiments, their alternatives, and what is predicted of them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import CIRCLE_FACTOR
from livebode.dataclass import dataclass
from livebode.excitation import MatrixExcitation
from livebode_design.matrix.machine import LimitedPeak, MatrixLimits, MatrixMachine
from livebode_design.matrix.spec import MatrixSpec


@dataclass(frozen=True)
class Alternative:
    """One kind of experiments for the same specification.

    Attributes
    ----------
    kind
        Of the experiments.
    settle_periods, repetitions, time_s
        Periods until the transient has decayed, repetitions of all experiments, and their time.
    amplitude_n_m
        Of each line, for each input.
    share
        Largest sigma of an entry over the required one; with a time only, the largest 95 % bound over the response.
    limited_by
        Names of the signals that reach their limit.
    """

    kind: str
    settle_periods: int
    repetitions: int
    time_s: float
    amplitude_n_m: tuple[float, ...]
    share: float
    limited_by: tuple[str, ...]


@dataclass(frozen=True)
class MatrixChoice:
    """A decision with its reason."""

    what: str
    value: str
    why: str


@dataclass(frozen=True, eq=False)
class MatrixDesign:
    """Experiments for several inputs, with the predicted accuracy and the peaks of all axes.

    Attributes
    ----------
    machine, limits, spec
        What it was designed for.
    excitation
        One repetition of the experiments.
    repetitions, time_s
        How often they are played, and the time of all.
    response
        Of the plant at the lines, shape (lines, outputs, inputs).
    sigma
        Predicted standard deviation of each entry after all repetitions, in its unit, shape of `response`.
    peaks
        Of the limited signals, transients included.
    alternatives
        All kinds that were compared, the chosen one first.
    choices
        What was chosen, and why.
    """

    machine: MatrixMachine
    limits: MatrixLimits
    spec: MatrixSpec
    excitation: MatrixExcitation
    repetitions: int
    time_s: float
    response: Complex
    sigma: Floats
    peaks: tuple[LimitedPeak, ...]
    alternatives: tuple[Alternative, ...]
    choices: tuple[MatrixChoice, ...]

    @property
    def bound(self) -> Floats:
        """The 95 % bound of each entry as a share of the largest response of its output, shape of `sigma`."""
        return np.asarray(CIRCLE_FACTOR * self.sigma / np.abs(self.response).max(axis=2, keepdims=True))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the plant inputs."""
        return self.machine.inputs

    @property
    def excitations(self) -> tuple[str, ...]:
        """Names of the excitations, one for each input."""
        return self.machine.excitations

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(name for name, _ in self.machine.outputs)

    def plain(self) -> dict[str, Any]:
        """Everything that was chosen and predicted, as plain data."""
        lines = self.excitation.lines
        return {
            "kind": self.excitation.kind,
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "bins": list(lines.bins),
            "frequency_hz": lines.frequency_hz.tolist(),
            "experiments": len(self.excitation.spectra),
            "dwell_periods": self.excitation.dwell,
            "settle_periods": self.excitation.settle,
            "repetitions": self.repetitions,
            "time_s": self.time_s,
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "units": [unit for _, unit in self.machine.outputs],
            "sigma": self.sigma.tolist(),
            "bound_95": self.bound.tolist(),
            "peaks": [asdict(peak) for peak in self.peaks],
            "alternatives": [asdict(alternative) for alternative in self.alternatives],
            "choices": [asdict(choice) for choice in self.choices],
        }
