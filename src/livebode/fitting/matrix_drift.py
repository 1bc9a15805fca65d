"""Whether a machine with several inputs and outputs changes during a record, and what that adds to its matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import MatrixResponses, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.fitting.drift import Drift, drift_of
from livebode.fitting.time_course import GroupSeries
from livebode.fitting.window_groups import WindowGroups


@dataclass(frozen=True)
class Repetitions:
    """How matrices follow from repetitions of the experiments.

    Attributes
    ----------
    extent
        Samples from the first to the last one of a matrix of one repetition.
    cycle
        Samples after which the experiments repeat.
    memory
        Repetitions in an average; 1 without averages.
    """

    extent: int
    cycle: int
    memory: int

    @classmethod
    def of_experiments(cls, window: int, span: int, number: int, memory: int) -> Repetitions:
        """Of a number of experiments, each of so many samples."""
        return cls(window + span * (number - 1), span * number, memory)

    @classmethod
    def of(cls, responses: MatrixResponses) -> Repetitions:
        """As far as the extents of these matrices show: averages grow by a repetition until their memory is full."""
        known = responses.valid.any(axis=(1, 2))
        extents = np.unique((responses.sample - responses.first)[known]) + 1
        if extents.size < 2:
            return cls(int(extents[0]) if extents.size else 1, 1, 1)
        cycle = int(extents[1] - extents[0])
        return cls(int(extents[0]), cycle, 1 + int(extents[-1] - extents[0]) // cycle)


class MatrixDriftTest(StatefulBase):
    """Tests matrices, in order, for a change of the machine: `DriftTest` with all entries in the place of its lines.

    The noise of an output is the same in all of its entries, and that of the outputs is alike, so components are looked
    for in L⁻¹·G·R⁻ᵀ with the mean `noise` L·L* and `spread` R·R* of the matrices, whose entries have independent noise.

    An average of m repetitions is turned back into the newest of them: m·Gᵢ − (m − 1)·Gᵢ₋₁ while it grows, and
    m·(Gᵢ − Gᵢ₋₁) more than the repetition that it lost once its memory is full. The inputs are taken as constant.

    Parameters
    ----------
    values
        Lines, outputs and inputs of the matrices.
    rate_hz
        Of the samples.
    repetitions
        How the matrices follow from repetitions.

    Notes
    -----
    A matrix is computed from one experiment after the other. A change between them is divided among its columns, which
    is small beside a change over many repetitions.
    """

    _stage = Stage("matrix-drift-test", 1)
    _STATE = ("_groups", "_noise", "_spread", "_newest", "_average", "_gained")

    def __init__(self, values: tuple[int, int, int], rate_hz: float, repetitions: Repetitions) -> None:
        lines, outputs, inputs = self._shape = values
        self._rate_hz, self._of = rate_hz, repetitions
        self._groups = WindowGroups(lines * outputs * inputs)
        self._noise = np.zeros((lines, outputs, outputs), dtype=np.complex128)  # sums
        self._spread = np.zeros((lines, inputs, inputs), dtype=np.complex128)
        self._newest = np.zeros(2, dtype=np.int64)  # average: its newest sample and number of repetitions
        self._average = np.full(values, complex(np.nan, np.nan))
        # Repetitions in the average, the newest last.
        self._gained = np.full((repetitions.memory, *values), complex(np.nan, np.nan))

    def add(self, part: MatrixResponses) -> None:
        """Process the next matrices."""
        rows = np.flatnonzero(part.valid.any(axis=(1, 2)))
        if self._of.memory > 1:
            self._add_gained(part, rows)
            return
        chosen = rows[self._groups.apart(part.first[rows], part.sample[rows])]
        if chosen.size:
            part = part[chosen]
            self._add_noise(part)
            self._add(part.time_s, _values(part))

    def _add_noise(self, part: MatrixResponses) -> None:
        known = np.isfinite(part.dof) & (part.dof > 0)
        weight = np.where(known, part.dof, 0.0)[:, np.newaxis, np.newaxis, np.newaxis]
        for sums, values in ((self._noise, weight * np.where(weight > 0, part.noise, 0)), (self._spread, part.spread)):
            for row in np.where(np.isfinite(values), values, 0):  # one by one: the same for any way of cutting
                sums += row

    def _add_gained(self, part: MatrixResponses, rows: NDArray[np.intp]) -> None:
        """Add the repetition that each average gained, all at one place in the cycle."""
        of = self._of
        for row, first, sample in zip(rows.tolist(), part.first[rows].tolist(), part.sample[rows].tolist()):
            before, repetitions = self._newest.tolist()
            count = 1 + (sample - first + 1 - of.extent) // of.cycle
            follows = sample == before + of.cycle
            begins = count == 1 and (not repetitions or (sample - before) % of.cycle == 0)
            grows, full = follows and count == repetitions + 1, follows and count == repetitions == of.memory
            if not (begins or grows or full):
                continue
            now = part[row : row + 1]
            average = _values(now)[0]
            value = average
            if not begins:
                value = count * average - (repetitions if grows else count) * self._average
                value = value + self._gained[0] if full else value
            self._newest[:], self._average = (sample, count), average
            self._gained = np.concatenate([self._gained[1:], value[np.newaxis]])
            self._add_noise(now)
            self._add(now.time_s + (count - 1) * of.cycle / 2 / self._rate_hz, value[np.newaxis])

    def _add(self, time_s: Floats, value: Complex) -> None:
        value = value.reshape(len(value), -1)
        self._groups.add(time_s, value, np.ones(value.shape))

    def result(self, *, whole: bool = False) -> Drift:
        """The test on all matrices up to now, for the newest one, or for the mean of the `whole` record.

        In the Drift, the entries of all lines are in the last axis of each array.
        """
        windows = max(self._groups.windows, 1)
        part = self._of.memory / windows if self._of.memory > 1 and not whole else 1.0
        return drift_of(self._groups, min(1.0, part), self._independent)

    def _independent(self, series: GroupSeries) -> GroupSeries:
        value = series.value.copy()
        line, output, input = np.unravel_index(series.at, self._shape)
        for k in np.unique(line):
            at = np.flatnonzero(line == k)
            rows, columns = np.unique(output[at]), np.unique(input[at])
            factors = [
                _inverse_root(sums[k][np.ix_(own, own)]) for sums, own in ((self._noise, rows), (self._spread, columns))
            ]
            whole = value[:, at].reshape(-1, rows.size, columns.size)
            value[:, at] = np.einsum("po,moi,ji->mpj", factors[0], whole, factors[1]).reshape(len(whole), -1)
        return replace(series, value=value)

    @property
    def _identity(self) -> str:
        return f"{self._shape} {self._rate_hz} {self._of}"


def _values(part: MatrixResponses) -> Complex:
    return np.asarray(np.where(part.valid[:, :, np.newaxis, :], part.value, np.nan))


def _inverse_root(covariance: Complex) -> Complex:
    """L⁻¹ of L·L*; without a covariance that has one, nothing is changed."""
    size = np.einsum("oo->o", covariance).real
    unit = np.sqrt(np.where(size > 0, size, 1.0))
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance / np.outer(unit, unit))) / unit)
    except np.linalg.LinAlgError:
        return np.eye(len(covariance), dtype=np.complex128)


def matrix_with_drift(matrix: MatrixResponses, drift: Drift) -> MatrixResponses:
    """A matrix, of one row, whose sigma contains the change of the machine meanwhile, as the test found it.

    Its `noise` is that about the course of the response, for each output that of the mean of its entries.
    """
    if not drift.tested:
        return matrix
    shape, measured = matrix.value.shape, matrix.noise_variance
    with np.errstate(invalid="ignore", divide="ignore"):
        share = (drift.noise(np.sqrt(measured).ravel()) ** 2).reshape(shape) / measured
    known = np.isfinite(share)
    of_output = np.sum(np.where(known, share, 0.0), axis=3) / np.maximum(known.sum(axis=3), 1)
    root = np.sqrt(np.where(known.any(axis=3), of_output, 1.0))
    matrix = replace(matrix, noise=matrix.noise * root[..., :, np.newaxis] * root[..., np.newaxis, :])
    variation = drift.variation(np.sqrt(matrix.noise_variance).ravel()).reshape(shape)
    return replace(matrix, variation=np.where(matrix.valid[:, :, np.newaxis, :], variation, np.nan))
