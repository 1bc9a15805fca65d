"""The NumPy twin of the matrix stage: the readable definition of what `process_matrices` computes in C.

The same operations in the same order for each line, so C must agree with it to the bit (except for the sign and
payload of NaN). A complex number is a pair of arrays over the lines, because NumPy's products of complex numbers round
otherwise in the last elements of an array.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.kernel import MatrixHistory, MatrixRows, MatrixStage, MatrixWindows

Floats = npt.NDArray[np.float64]

_ABOVE_NOISE = 3.0
"""An input moves by itself where the smallest singular value is this many times what noise alone has."""
_CONDITION_KNOWN = 1e4
"""Condition number up to which the inverse of S_dd, whose own is the square, has eight digits."""
_RANK = 1e-10
"""Relative size of singular values that are zero but for rounding."""


class ComplexParts(NamedTuple):
    """Real and imaginary parts, shape (lines,)."""

    re: Floats
    im: Floats

    def plus(self, b: ComplexParts) -> ComplexParts:
        return ComplexParts(self.re + b.re, self.im + b.im)

    def minus(self, b: ComplexParts) -> ComplexParts:
        return ComplexParts(self.re - b.re, self.im - b.im)

    def times(self, b: ComplexParts) -> ComplexParts:
        return ComplexParts(self.re * b.re - self.im * b.im, self.re * b.im + self.im * b.re)

    def against(self, b: ComplexParts) -> ComplexParts:
        """Times conj(b)."""
        return ComplexParts(self.re * b.re + self.im * b.im, self.im * b.re - self.re * b.im)

    def scaled(self, by: float | Floats) -> ComplexParts:
        return ComplexParts(self.re * by, self.im * by)

    @property
    def conjugate(self) -> ComplexParts:
        return ComplexParts(self.re, -self.im)

    @property
    def power(self) -> Floats:
        return self.re * self.re + self.im * self.im


Window = list[ComplexParts]
Matrix = list[list[ComplexParts]]


class _Row:
    """One row of results: the windows it is computed from."""

    def __init__(self, stage: MatrixStage, history: MatrixHistory, newest: int) -> None:
        self.s, self._h, self._newest = stage, history, newest
        self.complete = self._complete()
        self.skipped = 0 if stage.average else 1
        self.used = self.complete if stage.average or not self.complete else 1
        self.judged = max(self.complete - self.skipped, 0)
        self.dof = float((self.judged - 1) * stage.experiments) if self.judged > 1 else 0.0

    def _place(self, repetition: int, experiment: int) -> int:
        back = self.s.places * (repetition * self.s.experiments + experiment)
        return (self._newest - back) % len(self._h.complete)

    def _complete(self) -> int:
        for i in range(self.s.repetitions):
            if not all(self._h.complete[self._place(i, e)] for e in range(self.s.experiments)):
                return i
        return self.s.repetitions

    def window(self, repetition: int, experiment: int) -> Window:
        return [ComplexParts(*signal) for signal in self._h.spectrum[self._place(repetition, experiment)]]

    def mean(self, experiment: int) -> Window:
        found = self.window(0, experiment)
        for i in range(1, self.used):
            found = [a.plus(b) for a, b in zip(found, self.window(i, experiment))]
        return [a.scaled(1.0 / self.used) for a in found] if self.used > 1 else found

    @property
    def zero(self) -> ComplexParts:
        return ComplexParts(np.zeros(self.s.lines), np.zeros(self.s.lines))

    def matrix(self, rows: int, columns: int) -> Matrix:
        return [[self.zero] * columns for _ in range(rows)]


def process_matrices(stage: MatrixStage, history: MatrixHistory, windows: MatrixWindows, out: MatrixRows) -> None:
    """A matrix for each window into `out`; the windows are added to the history."""
    for array in out[:5]:
        array.view(np.float64)[:] = np.nan
    out.sure[:] = False
    signals = stage.outputs + stage.inputs + stage.beside
    for at, place in enumerate(windows.row):
        newest = (windows.first + at) % len(history.complete)
        spectrum = windows.spectrum[:signals, place, : stage.lines]
        history.spectrum[newest, :, 0], history.spectrum[newest, :, 1] = spectrum.real, spectrum.imag
        history.complete[newest] = windows.clean[place]
        row = _Row(stage, history, newest)
        out.complete[at], out.dof[at] = row.complete, row.dof
        if row.complete:
            with np.errstate(all="ignore"):
                _process(row, history.work, at, out)


def _process(row: _Row, work: Floats, at: int, out: MatrixRows) -> None:
    s = row.s
    cross, gram = _products(row)
    inverse = _inverse(gram)
    value, signal = _solution(row, cross, inverse)
    noise, moved = _scatter(row, value)
    with_mean = _inverse(_mean_gram(row)) if row.used > 1 and not s.means else inverse
    size = _mean_gram(row) if row.used > 1 and not s.means else gram
    for i in range(s.inputs):
        work[0, i], work[1, i], work[2, i] = size[i][i].re, with_mean[i][i].re, _at_least(0.0, moved[i])
    share = 1.0 / row.dof if row.dof > 0 else np.nan
    for o in range(s.outputs):
        noise[o][o] = ComplexParts(_at_least(0.0, noise[o][o].re), np.zeros(s.lines))
        out.coherence[at, :, o] = signal[o] / (signal[o] + noise[o][o].re * share)
        for p in range(o):
            noise[p][o] = noise[o][p].conjugate
    _write(out.value[at], value, 1.0)
    _write(out.noise[at], noise, share)
    _write(out.spread[at], [[x.conjugate for x in line] for line in inverse], 1.0 / row.used if s.means else 1.0)
    _judge(row, work, at, out)


def _write(out: npt.NDArray[np.complex128], matrix: Matrix, by: float) -> None:
    for i, line in enumerate(matrix):
        for k, x in enumerate(line):
            out.real[:, i, k], out.imag[:, i, k] = x.scaled(by)


def _at_least(bound: float, x: Floats) -> Floats:
    return np.where(bound > x, bound, x)


def _products(row: _Row) -> tuple[Matrix, Matrix]:
    """S_yd and the lower triangle of S_dd."""
    s = row.s
    if s.means:
        windows = [row.mean(e) for e in range(s.experiments)]
    else:
        windows = [row.window(i, e) for i in range(row.used) for e in range(s.experiments)]
    cross, gram = row.matrix(s.outputs, s.inputs), row.matrix(s.inputs, s.inputs)
    for x in windows:
        y, d = x[: s.outputs], x[s.outputs :]
        for i in range(s.inputs):
            for o in range(s.outputs):
                cross[o][i] = cross[o][i].plus(y[o].against(d[i]))
            for k in range(i + 1):
                gram[i][k] = gram[i][k].plus(d[i].against(d[k]))
    return cross, gram


def _mean_gram(row: _Row) -> Matrix:
    """That of the mean of the inputs over the repetitions."""
    gram = row.matrix(row.s.inputs, row.s.inputs)
    for e in range(row.s.experiments):
        d = row.mean(e)[row.s.outputs :]
        for i in range(row.s.inputs):
            for k in range(i + 1):
                gram[i][k] = gram[i][k].plus(d[i].against(d[k]))
    return gram


def _inverse(gram: Matrix) -> Matrix:
    """Of a Hermitian matrix, of which the lower triangle is given: L·P·L*, then L⁻*·P⁻¹·L⁻¹."""
    size, a, pivot = len(gram), [list(line) for line in gram], []
    zero = ComplexParts(np.zeros_like(gram[0][0].re), np.zeros_like(gram[0][0].re))
    for j in range(size):
        pivot.append(1.0 / a[j][j].re)
        column = [a[i][j] for i in range(size)]
        for i in range(j + 1, size):
            a[i][j] = a[i][j].scaled(pivot[j])
            for k in range(j + 1, i + 1):
                a[i][k] = a[i][k].minus(a[i][j].against(column[k]))
    for j in range(size):
        for i in range(j + 1, size):
            total = a[i][j]
            for k in range(j + 1, i):
                total = total.plus(a[i][k].times(a[k][j]))
            a[i][j] = zero.minus(total)
    for i in range(size):
        for j in range(i + 1):
            total = ComplexParts(pivot[i], zero.re) if i == j else a[i][j].scaled(pivot[i])
            for k in range(i + 1, size):
                total = total.plus(a[k][j].against(a[k][i]).scaled(pivot[k]))
            a[i][j] = total
            a[j][i] = total.conjugate
    return a


def _solution(row: _Row, cross: Matrix, inverse: Matrix) -> tuple[Matrix, list[Floats]]:
    """G = S_yd·S_dd⁻¹, and the power of G·d, which is the diagonal of G·S_dy."""
    s = row.s
    windows = float(s.experiments * (1 if s.means else row.used))
    value, signal = row.matrix(s.outputs, s.inputs), []
    for o in range(s.outputs):
        power = np.zeros(s.lines)
        for i in range(s.inputs):
            total = row.zero
            for k in range(s.inputs):
                total = total.plus(cross[o][k].times(inverse[k][i]))
            value[o][i] = total
            power = power + cross[o][i].against(total).re
        signal.append(_at_least(0.0, power * (1.0 / windows)))
    return value, signal


def _scatter(row: _Row, value: Matrix) -> tuple[Matrix, list[Floats]]:
    """Σ δz·δz* of z = y − G·d around the mean of each experiment, lower triangle, and Σ|δd|² of each input.

    From deviations from the first window that is judged, so that rounding of the excitation does not enter.
    """
    s, share = row.s, 1.0 / max(row.judged, 1)
    noise, moved = row.matrix(s.outputs, s.outputs), [np.zeros(s.lines)] * s.inputs
    for e in range(s.experiments if row.judged > 1 else 0):
        begin, sums = row.window(row.skipped, e), [row.zero] * (s.outputs + s.inputs)
        for i in range(1, row.judged):
            x = [a.minus(b) for a, b in zip(row.window(row.skipped + i, e), begin)]
            for o in range(s.outputs):
                for k in range(s.inputs):
                    x[o] = x[o].minus(value[o][k].times(x[s.outputs + k]))
            sums = [a.plus(b) for a, b in zip(sums, x)]
            moved = [a + b.power for a, b in zip(moved, x[s.outputs :])]
            for o in range(s.outputs):
                for p in range(o + 1):
                    noise[o][p] = noise[o][p].plus(x[o].against(x[p]))
        moved = [a - b.power * share for a, b in zip(moved, sums[s.outputs :])]
        for o in range(s.outputs):
            for p in range(o + 1):
                noise[o][p] = noise[o][p].minus(sums[o].against(sums[p]).scaled(share))
    return noise, moved


def _judge(row: _Row, work: Floats, at: int, out: MatrixRows) -> None:
    """Whether the inputs separate, with each input scaled to the same power over all lines.

    Bounds of the singular values are from ‖D‖² and ‖D⁻¹‖² (Frobenius). With the largest and the smallest paired
    crosswise, Cauchy–Schwarz gives ‖D‖·‖D⁻¹‖ ≥ κ + 1/κ + n − 2; for two inputs it is an equality.
    """
    s = row.s
    direct, inverse, moved = np.zeros((3, s.lines))
    for size, size_inverse, scatter in zip(*work):
        total = 0.0
        for one in size:
            total = total + one
        scale = total * (1.0 / (s.lines * s.experiments))
        share = 1.0 / scale
        direct = direct + size * share
        inverse = inverse + size_inverse * scale
        moved = np.maximum(moved, scatter * share)
    half = _at_least(1.0, (np.sqrt(direct * inverse) - (s.inputs - 2.0)) * 0.5)
    condition = half + np.sqrt(half * half - 1.0)
    least = np.sqrt(direct * (1.0 / s.inputs)) / condition
    least = np.maximum(least, np.sqrt(1.0 / inverse))
    level, windows = np.zeros(s.lines), row.dof * row.used
    if windows > 0:
        factor = np.sqrt(np.float64(s.inputs)) + np.sqrt(np.float64(s.experiments))
        level = _ABOVE_NOISE * factor * np.sqrt(moved * (1.0 / windows))
    rank = _RANK * np.max(np.sqrt(direct))
    out.condition[at] = condition
    out.sure[at] = (min(s.condition_max, _CONDITION_KNOWN) > condition) & (least > level) & (least > rank)
