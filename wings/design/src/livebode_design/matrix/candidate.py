"""One kind of experiments: phases, settling time and amplitudes within the limits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from livebode.arrays import Floats
from livebode.core import DesignError, Lines, UsageError
from livebode.excitation import MatrixExcitation, low_crest_phases
from livebode_design.matrix.amplitude import best_amplitudes
from livebode_design.matrix.machine import LimitedPeak, MatrixLimits, MatrixMachine
from livebode_design.matrix.spec import Kind, MatrixSpec

RESERVE = 0.1
"""Share of each limit that remains for errors of the prediction and for noise."""
REPETITIONS_MIN, REPETITIONS_MAX = 2, 1000
"""The noise is estimated from the scatter between repetitions, and a tracker remembers so many."""
SETTLED = 0.1
"""A transient has decayed where it is this share of the noise of a line, after all repetitions."""
_SETTLE_MAX = 998
_SAMPLES_MAX = 2_000_000  # of one repetition: more are a slip in the description
_TRIES = 5
_RATIO_MAX = 1e7  # of sigma over the required one: 1e14 repetitions
_REACHED = 0.01  # of a limit: it is named as the limiting one
_STARTS = 32  # of the search for phases


@dataclass(frozen=True, eq=False)
class Candidate:
    """Experiments of one kind at the largest amplitudes.

    Attributes
    ----------
    excitation
        One repetition.
    ratio
        Sigma of each entry from one repetition over the required one, shape (lines, outputs, inputs).
    peaks
        Of the limited signals.
    """

    excitation: MatrixExcitation
    amplitude: Floats
    ratio: Floats
    peaks: tuple[LimitedPeak, ...]

    @property
    def repetition_s(self) -> float:
        """Time of one repetition."""
        return float(self.excitation.samples.shape[1] / self.excitation.lines.rate_hz)

    @property
    def needed(self) -> int:
        """Repetitions until every entry reaches the required sigma; also more than can be remembered."""
        return max(REPETITIONS_MIN, ceil(float(self.ratio.max()) ** 2 * (1 - 1e-9)))

    @property
    def limited_by(self) -> tuple[str, ...]:
        """Signals that reach their limit, without the reserve."""
        full = (1 - RESERVE) * (1 - _REACHED)
        return tuple(peak.name for peak in self.peaks if peak.size >= full * peak.limit)


def candidate(kind: Kind, spec: MatrixSpec, machine: MatrixMachine, limits: MatrixLimits, lines: Lines) -> Candidate:
    """The kind with the settling time of the slowest mode, which depends on the amplitudes, and these on the time."""
    phases = _phases(kind, lines, len(machine.inputs), spec.seed)
    settle = spec.settle_periods or 1
    for _ in range(_TRIES):
        found = _at(kind, spec, machine, limits, lines, phases, settle)
        needed = _settle(found, spec, machine)
        if spec.settle_periods is not None or needed <= settle:
            break
        settle = needed
    return found


def _phases(kind: Kind, lines: Lines, inputs: int, seed: int) -> Floats:
    """Low-crest phases of the lines that an input has together: of interleaved ones every n-th."""
    step = inputs if kind == "interleaved" else 1
    phases = np.zeros(len(lines))
    for first in range(min(step, len(lines))):
        phases[first::step] = low_crest_phases(lines.bins[first::step], seed=seed, starts=_STARTS)
    return phases


@np.errstate(all="ignore")  # what cannot be computed with is found at the end
def _at(
    kind: Kind,
    spec: MatrixSpec,
    machine: MatrixMachine,
    limits: MatrixLimits,
    lines: Lines,
    phases: Floats,
    settle: int,
) -> Candidate:
    samples = (settle + 1) * lines.window * len(machine.inputs)
    if samples > _SAMPLES_MAX:
        raise DesignError(
            "not-enough-time",
            f"the transient of a change of experiment needs {settle} periods of {lines.window} samples to decay, "
            f"so that one repetition has {samples:,} samples, more than {_SAMPLES_MAX:,}",
            "correct the damping, the gains or the noise, or set settle_periods",
            settle_periods=settle,
        )
    make = getattr(MatrixExcitation, kind)
    unit: MatrixExcitation = make(lines, len(machine.inputs), 1.0, phases, dwell=settle + 1, settle=settle)
    signals, peaks = machine.unit_signals(unit, limits)
    cost = _cost(unit, spec, machine)
    amplitude = best_amplitudes(cost.reshape(-1, cost.shape[-1]), signals / (1 - RESERVE))
    sizes = np.abs(signals @ amplitude).max(axis=1)
    reached = tuple(replace(one, size=float(size * one.limit)) for one, size in zip(peaks, sizes))
    ratio = np.sqrt(cost @ amplitude**-2.0)
    if not np.isfinite(ratio).all() or not 0 < ratio.max() < _RATIO_MAX:
        raise UsageError(
            "out-of-range",
            "the noise, a limit, the required sigma or a value of the machine is too large or small to compute with",
            "correct it",
            argument="noise",
        )
    return Candidate(unit.scaled(amplitude), amplitude, ratio, reached)


def _cost(unit: MatrixExcitation, spec: MatrixSpec, machine: MatrixMachine) -> Floats:
    """What amplitude a_j of input j adds to the squared ratio of an entry, times a_j², (lines, outputs, inputs, j).

    `predict` has the covariance (U·U*)⁻¹ with U = (1 + F·G)⁻¹·diag(a)·W. The excitations of all kinds are orthogonal
    over the experiments, W·W* is diagonal, and the diagonal of the inverse is Σ_j |(1 + F·G)_ji|²/(a_j²·‖W_j‖²).
    """
    f = unit.lines.frequency_hz
    response = machine.response(f)
    difference = np.eye(response.shape[2]) + machine.described.feedback_at(f) @ response  # (lines, j, inputs)
    energy = np.sum(np.abs(unit.spectra) ** 2, axis=0).T  # (lines, j)
    spread = np.abs(difference.transpose(0, 2, 1)) ** 2 / energy[:, None, :]
    noise = machine.deviation(f)[:, :, None, None] ** 2 * 4 / unit.lines.window
    wanted = spec.target(response)
    return np.asarray(noise * spread[:, None, :, :] / wanted[..., None] ** 2)


def _settle(found: Candidate, spec: MatrixSpec, machine: MatrixMachine) -> int:
    """Periods in which a transient decays below the noise of a line, after all repetitions."""
    lines = found.excitation.lines
    line_noise = (
        machine.deviation(lines.frequency_hz).min(axis=0) * 2 / np.sqrt(lines.window * repetitions(found, spec))
    )
    return int(np.clip(machine.settle_periods(found.excitation, SETTLED * line_noise), 1, _SETTLE_MAX))


def repetitions(found: Candidate, spec: MatrixSpec) -> int:
    """How often the experiments are played: until the required sigma, or while there is time."""
    if spec.requires:
        return found.needed
    assert spec.time_s is not None
    in_time = int(spec.time_s / found.repetition_s * (1 + 1e-12))
    return min(REPETITIONS_MAX, max(REPETITIONS_MIN, in_time))
