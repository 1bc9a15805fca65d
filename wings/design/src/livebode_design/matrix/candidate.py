"""One kind of experiments: phases, settling time and amplitudes within the limits."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from livebode.arrays import Floats
from livebode.core import DesignError, Lines, UsageError, needing
from livebode.dataclass import dataclass
from livebode.excitation import MatrixExcitation, low_crest_phases
from livebode_design.matrix.machine import LimitedPeak, MatrixLimits, MatrixMachine
from livebode_design.matrix.spec import Kind, MatrixSpec

_ROUNDS = 40
_TOLERANCE = 1e-5  # of a limit, and of the largest cost


def best_amplitudes(cost: Floats, peaks: Floats) -> Floats:
    """a > 0 that minimises the largest Σ_j cost[r, j]/a_j² with |Σ_j peaks[s, t, j]·a_j| ≤ 1, shape (inputs,).

    The costs are convex in a and the limits linear, so the minimum is the only one. SciPy's SLSQP solves it for few
    rows and samples; those that its solution violates most are added until there are none.

    Parameters
    ----------
    cost
        At least 0, shape (rows, inputs).
    peaks
        Signals as a share of their limits, shape (signals, samples, inputs).

    Examples
    --------
    Two inputs that share one limit, of which the second is four times as costly:

    >>> best_amplitudes(np.array([[1.0, 8.0]]), np.array([[[1.0, 1.0]]])).round(4)
    array([0.3333, 0.6667])
    """
    inputs = cost.shape[1]
    alone = np.abs(peaks).max(axis=(0, 1))
    scale = 1 / (inputs * np.where(alone > 0, alone, 1.0))
    price, reach = cost / scale**2, peaks * scale
    limits, rows = np.empty((0, inputs)), np.empty((0, inputs))
    a = np.ones(inputs)
    for _ in range(_ROUNDS):
        seen = reach @ a
        worst = np.abs(seen).argmax(axis=1)
        sample = np.arange(len(seen))
        violated = np.abs(seen[sample, worst]) > (1 + _TOLERANCE if len(limits) else 0)
        value = price @ a**-2.0
        known = (rows @ a**-2.0).max() if len(rows) else 0.0
        if not violated.any() and value.max() <= known * (1 + _TOLERANCE):
            break
        signs = np.sign(seen[sample, worst])[:, None]
        limits = np.vstack([limits, (signs * reach[sample, worst])[violated]])
        rows = np.vstack([rows, price[[value.argmax()]]])
        a = _solved(rows, limits, a)
    return np.asarray(a * scale / np.abs(reach @ a).max())


def _solved(rows: Floats, limits: Floats, begin: Floats) -> Floats:
    """The minimum for these rows and limits only, in a and t ≥ log(cost)."""
    with needing("SciPy", "analysis", "a design for several inputs"):
        from scipy.optimize import minimize

    inside = begin / max(1.0, float((limits @ begin).max()))
    start = np.append(inside, np.log((rows @ inside**-2.0).max()))
    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[-1] - np.log(rows @ x[:-1] ** -2.0),
            "jac": lambda x: np.hstack(
                [2 * rows * x[:-1] ** -3.0 / (rows @ x[:-1] ** -2.0)[:, None], np.ones((len(rows), 1))]
            ),
        },
        {
            "type": "ineq",
            "fun": lambda x: 1 - limits @ x[:-1],
            "jac": lambda _: np.hstack([-limits, np.zeros((len(limits), 1))]),
        },
    ]
    solution = minimize(  # type: ignore[call-overload]
        lambda x: float(x[-1]),
        start,
        jac=lambda _: np.eye(len(start))[-1],
        bounds=[*[(1e-6, 1e6)] * len(inside), (None, None)],
        constraints=constraints,
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-10},
    )
    return np.asarray(solution.x[:-1], dtype=np.float64)


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
        experiments = _at(kind, spec, machine, limits, lines, phases, settle)
        needed = _settle(experiments, spec, machine)
        if spec.settle_periods is not None or needed <= settle:
            break
        settle = needed
    return experiments


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
    reached = tuple(replace(peak, size=float(size * peak.limit)) for peak, size in zip(peaks, sizes))
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


def _settle(candidate: Candidate, spec: MatrixSpec, machine: MatrixMachine) -> int:
    """Periods in which a transient decays below the noise of a line, after all repetitions."""
    lines = candidate.excitation.lines
    line_noise = (
        machine.deviation(lines.frequency_hz).min(axis=0) * 2 / np.sqrt(lines.window * repetitions(candidate, spec))
    )
    return int(np.clip(machine.settle_periods(candidate.excitation, SETTLED * line_noise), 1, _SETTLE_MAX))


def repetitions(candidate: Candidate, spec: MatrixSpec) -> int:
    """How often the experiments are played: until the required sigma, or while there is time."""
    if spec.requires:
        return candidate.needed
    assert spec.time_s is not None
    in_time = int(spec.time_s / candidate.repetition_s * (1 + 1e-12))
    return min(REPETITIONS_MAX, max(REPETITIONS_MIN, in_time))
