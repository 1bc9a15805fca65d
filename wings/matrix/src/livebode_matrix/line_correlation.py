"""How far the errors of the lines of a matrix are alike, from the rows of a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import MatrixResponses
from livebode.dataclass import dataclass
from livebode.fitting import mean_matrix

_STEPS_MIN, _STEPS_MAX = 10, 128
_MARGIN = 2.0  # standard deviations
_SHARE_MAX = 0.5  # of a line's noise that leakage has, where that is a slow drift: the largest share of all poles


@dataclass(frozen=True)
class LineCorrelation:
    """Second and third cumulant of a sum over lines, in units of those of independent lines.

    Of the covariance R of the real and imaginary parts of all errors, of which each error has the power 1, they are
    2·tr R² and 4·tr R³ over the number of errors.
    """

    second: float = 1.0
    third: float = 1.0

    @classmethod
    def largest(cls, lines: int) -> LineCorrelation:
        """Where leakage that all lines share, of several states, has half of the power of each."""
        common, own = _SHARE_MAX * lines + 1 - _SHARE_MAX, 1 - _SHARE_MAX
        return cls((common**2 + (lines - 1) * own**2) / lines, (common**3 + (lines - 1) * own**3) / lines)


INDEPENDENT = LineCorrelation()


@dataclass(frozen=True, eq=False)
class RowSteps:
    """Differences between successive rows that have gained one experiment and lost one: errors of the experiments.

    A window begins and ends with different states. What this adds to a spectrum (leakage) is a smooth function of
    frequency, so the errors of lines beside a slow mode are alike, also of lines that are several bins apart. A state
    is a real number, so its leakage has a certain phase at each line: real and imaginary part of an error are not
    alike. Two steps are independent unless an experiment that one has gained is lost by the other.

    Attributes
    ----------
    step
        Shape (steps, lines, outputs, inputs).
    independent
        Shape (steps, steps).
    """

    step: Complex
    independent: Flags

    @classmethod
    def of(cls, responses: MatrixResponses) -> RowSteps:
        """Those of the rows that are valid at all lines of the mean of all rows; FitError where that has none."""
        lines = mean_matrix(responses).valid[0].all(axis=1)
        length = responses.sample - responses.first
        # Earlier rows of an average gain an experiment and lose none.
        full = length == length.max()
        rows = np.flatnonzero(full & responses.valid[:, lines].all(axis=(1, 2)) & bool(lines.any()))
        if not rows.size:
            return cls(responses.value[:0], np.zeros((0, 0), dtype=np.bool_))
        chosen = [int(rows[0])]
        for row in rows[1:].tolist():
            if responses.sample[row] - responses.sample[chosen[-1]] >= responses.lines.window:
                chosen.append(row)
        chosen = chosen[-_STEPS_MAX - 1 :]
        first, sample = responses.first[chosen], responses.sample[chosen]
        moved = np.diff(sample)
        slides = (np.diff(first) == moved) & (first[1:] <= sample[:-1])
        gained = np.stack([sample[:-1] + 1, sample[1:] + 1], axis=1)[slides]
        lost = np.stack([first[:-1], first[1:]], axis=1)[slides]
        shared = _overlap(gained, gained) | _overlap(lost, lost) | _overlap(gained, lost) | _overlap(lost, gained)
        return cls(np.diff(responses.value[chosen], axis=0)[slides], ~shared)

    def joined(self, other: RowSteps) -> RowSteps:
        """Those of two recordings."""
        mine, theirs = len(self.step), len(other.step)
        independent = np.ones((mine + theirs, mine + theirs), dtype=np.bool_)
        independent[:mine, :mine], independent[mine:, mine:] = self.independent, other.independent
        return RowSteps(np.concatenate([self.step, other.step]), independent)

    def entry(self, output: int, input: int) -> RowSteps:
        """The steps of one entry."""
        return RowSteps(self.step[:, :, output : output + 1, input : input + 1], self.independent)

    def correlation(self, use: Flags, noise: Complex, spread: Complex) -> LineCorrelation:
        """Correlation between lines of errors with the covariance noise ⊗ spread at the lines in `use`.

        It is estimated by the sums over pairs and triples of independent steps, which are unbiased, plus two standard
        deviations: what is underestimated here becomes false alarms far out in the tail. It is the largest where steps
        are too few.
        """
        lines = int(np.count_nonzero(use))
        if len(self.step) < _STEPS_MIN or lines < 2:
            return LineCorrelation.largest(lines)
        left, right = (np.linalg.inv(np.linalg.cholesky(covariance)) for covariance in (noise, spread))
        apart = np.einsum("kpo,rkoi,kji->rkpj", left, self.step[:, use], right).reshape(len(self.step), -1)
        second, third = _with_margin((apart @ apart.conj().T).real, self.independent, apart.shape[1])
        second = max(second, 1.0)
        return LineCorrelation(second, max(third, second**2))


def _with_margin(products: Floats, independent: Flags, errors: int) -> tuple[float, float]:
    """2·tr R² and 4·tr R³ over the number of errors, of their products, each larger by its uncertainty (jackknife)."""
    member = independent.astype(np.float64)
    of_pairs, of_triples = (products * member) ** 2, products * member
    cubes, members = (np.diag(matrix @ matrix @ matrix) for matrix in (of_triples, member))
    steps = len(member)
    # Without one step after the other, and with all; in a triple each of three may be the step that is missing.
    weights = np.vstack([np.ones((steps, steps)) - np.eye(steps), np.ones(steps)])
    missing = 1 - weights
    power = weights @ np.diag(products) / weights.sum(axis=1)
    pairs, pair_count = (matrix.sum() - 2 * missing @ matrix.sum(axis=1) for matrix in (of_pairs, member))
    triples, triple_count = (matrix.sum() - 3 * missing @ matrix for matrix in (cubes, members))
    second = 2 * errors * pairs / np.maximum(pair_count, 1) / power**2
    third = 4 * errors**2 * triples / np.maximum(triple_count, 1) / power**3
    bounds = [all_of[-1] + _MARGIN * np.sqrt((steps - 1) * np.var(all_of[:-1])) for all_of in (second, third)]
    return float(bounds[0]), float(bounds[1])


def _overlap(windows: NDArray[np.int64], others: NDArray[np.int64]) -> Flags:
    """Which windows first … stop − 1 share a sample, shape (windows, others)."""
    begin = np.maximum(windows[:, np.newaxis, 0], others[:, 0])
    return np.asarray(begin < np.minimum(windows[:, np.newaxis, 1], others[:, 1]))
