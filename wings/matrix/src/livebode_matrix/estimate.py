"""The estimate of matrices from spectra of several experiments, and of their noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.dataclass import dataclass

_SURE = 3.0
"""An input moves by itself where the smallest singular value is this many times what noise alone has."""
_OUTSIDE = 1e-6
"""Share of a column outside of what the experiments determine; numerical errors are far below it."""
_RANK = 1e-10
"""Relative size of singular values that are zero but for rounding."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Spectra of the windows that each row is computed from; the newest repetition of the experiments is first.

    Attributes
    ----------
    output, denominator, reference
        Shapes (rows, lines, repetitions, signals, experiments). A reference that is None is the mean of the denominator
        over the repetitions. With as many experiments as references, this is the estimate of any reference that is the
        same in all repetitions: S_yr·S_dr⁻¹ = (Ȳ·R*)·(D̄·R*)⁻¹ = Ȳ·D̄⁻¹ with means over the repetitions.
    count
        Repetitions without a gap, shape (rows,).
    excitation
        Of which it is verified that they are different experiments; None: it is not.
    """

    output: Complex
    denominator: Complex
    reference: Complex | None
    count: NDArray[np.int64]
    excitation: Complex | None = None


@dataclass(frozen=True, eq=False)
class MatrixEstimate:
    """Matrices of some rows; the attributes are those of MatrixResponses."""

    value: Complex
    noise: Complex
    spread: Complex
    dof: Floats
    coherence: Floats
    condition: Floats
    reason: NDArray[np.int8]


def estimate(windows: Windows, average: bool, condition_max: float) -> MatrixEstimate:
    """Q = S_yr·S_dr⁻¹ over the experiments, with the noise of y − Q·d between their repetitions.

    The error of Q is V·P for noise V in the windows of y − Q·d, where P = R*·S_dr⁻¹. Its covariance is the Kronecker
    product of that of V and P*·P (Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 7.2).
    """
    repetitions, experiments = windows.output.shape[2], windows.output.shape[4]
    newest_only = 1 if not average else 0
    used = np.where(windows.count > 0, windows.count if average else 1, 0)
    part = slice(None) if average else slice(0, 1)
    scatter, dof = _scatter(windows, np.arange(repetitions) >= newest_only)
    outputs = windows.output.shape[3]
    mean = _mean(windows.denominator[:, :, part], used)
    kept, condition, reason = _separation(mean, scatter[:, :, outputs:, outputs:], dof, used, condition_max)
    if windows.excitation is not None:
        apart = separates(_mean(windows.excitation[:, :, part], used), condition_max)
        reason[(reason == 0).all(axis=2) & ~apart] = 3
    if windows.reference is None:
        y, d, r = _mean(windows.output[:, :, part], used), mean, mean
        of_one = 1.0 / np.maximum(used, 1)
    else:
        y, d, r = (
            _side_by_side(_only(s[:, :, part], used)) for s in (windows.output, windows.denominator, windows.reference)
        )
        of_one = np.ones(len(used))
    solution = _solution(d, r, kept, reason)
    value = y @ solution
    known = np.where(reason[:, :, None, :] == 0, value, 0.0)
    to_outputs = np.concatenate([np.tile(np.eye(outputs), (*value.shape[:2], 1, 1)), -known], axis=3)
    with np.errstate(invalid="ignore", divide="ignore"):
        noise = (
            to_outputs
            @ scatter
            @ _star(to_outputs)
            / np.where((dof > 0) & (used > 0), dof, np.nan)[:, None, None, None]
        )
        own = np.maximum(np.einsum("rkoo->rko", noise).real, 0.0)
        number = experiments * (1 if windows.reference is None else np.maximum(used, 1))
        signal = np.sum(np.abs(known @ d) ** 2, axis=3) / np.reshape(number, (-1, 1, 1))
        coherence = signal / (signal + own)
    spread = _star(solution) @ solution * of_one[:, None, None, None]
    spread = np.swapaxes(spread, 2, 3)  # E δ_i·conj(δ_j) is that of the rows of P
    return MatrixEstimate(value, noise, spread, dof, coherence, condition, reason)


def _mean(spectra: Complex, used: NDArray[np.int64]) -> Complex:
    """The mean of each experiment over its repetitions, shape (rows, lines, signals, experiments)."""
    return np.asarray(_only(spectra, used).sum(axis=2) / np.maximum(used, 1)[:, None, None, None])


def _star(matrix: Complex) -> Complex:
    return np.asarray(np.swapaxes(matrix, -1, -2).conj())


def _only(spectra: Complex, count: NDArray[np.int64]) -> Complex:
    """Zero where a repetition does not count; as it is where all do."""
    if (count == spectra.shape[2]).all():
        return spectra
    return np.asarray(spectra * (np.arange(spectra.shape[2]) < count[:, None])[:, None, :, None, None])


def _side_by_side(spectra: Complex) -> Complex:
    """Windows of all repetitions as columns, shape (rows, lines, signals, windows)."""
    rows, lines, repetitions, signals, experiments = spectra.shape
    return np.moveaxis(spectra, 2, 3).reshape(rows, lines, signals, repetitions * experiments)


def _scatter(windows: Windows, judging: Flags) -> tuple[Complex, Floats]:
    """Σ δx·δx* of x = (y, d) around the mean of each experiment, and its degrees of freedom, (rows,)."""
    both = np.concatenate([windows.output, windows.denominator], axis=3)[:, :, judging]
    number = np.clip(windows.count - (~judging).sum(), 0, None)
    both = _only(both, number)
    mean = both.sum(axis=2, keepdims=True) / np.maximum(number, 1)[:, None, None, None, None]
    deviation = _side_by_side(_only(both - mean, number))
    return deviation @ _star(deviation), np.maximum(number - 1.0, 0.0) * both.shape[4]


def _separation(
    mean: Complex, scatter: Complex, dof: Floats, used: NDArray[np.int64], condition_max: float
) -> tuple[Complex, Floats, NDArray[np.int8]]:
    """Projection onto what the experiments determine, the condition number, and the reason for each column."""
    inputs, experiments = mean.shape[2:]
    scale = np.sqrt(np.mean(np.abs(mean) ** 2, axis=(1, 3)))
    scale = np.where(scale > 0, scale, 1.0)[:, None, :]
    scaled = mean / scale[..., None]
    left, size, _ = np.linalg.svd(scaled, full_matrices=True)
    size = np.concatenate([size, np.zeros((*size.shape[:2], inputs - size.shape[2]))], axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        power = np.einsum("rkii->rki", scatter).real / scale**2 / (dof * used)[:, None, None]
        noise = _SURE * (np.sqrt(inputs) + np.sqrt(experiments)) * np.sqrt(power.max(axis=2))
        condition = size[:, :, 0] / size[:, :, -1]
    least = np.fmax(size[:, :, 0] / condition_max, np.where(np.isfinite(noise), noise, 0.0))[..., None]
    without = (size <= least) | (size <= _RANK * size.max(axis=(1, 2), keepdims=True))
    outside = np.einsum("rkij,rkj->rki", np.abs(left) ** 2, without.astype(float))
    still = np.sqrt(np.sum(np.abs(scaled) ** 2, axis=3)) <= least
    reason = np.where(outside > _OUTSIDE, np.where(still, 2, 3), 0).astype(np.int8)
    reason[used == 0] = 1
    condition[used == 0] = np.nan
    span = left * ~without[:, :, None, :]
    projection = (span @ _star(left)) * scale[..., None] / scale[:, :, None, :]
    return projection, condition, reason


def separates(excitation: Complex, condition_max: float) -> Flags:
    """Whether the excitations are as different over the experiments as inputs must be, shape (rows, lines).

    They are not where `dwell` or `start` is not that of the recording; the inputs may differ there by transients.
    """
    scale = np.sqrt(np.mean(np.abs(excitation) ** 2, axis=(1, 3)))
    size = np.linalg.svd(excitation / np.where(scale > 0, scale, 1.0)[:, None, :, None], compute_uv=False)
    return np.asarray(size[:, :, -1] > size[:, :, 0] / condition_max)


def _solution(d: Complex, r: Complex, kept: Complex, reason: NDArray[np.int8]) -> Complex:
    """P = R*·S_dr⁻¹, shape (rows, lines, windows, inputs); NaN in columns that are invalid."""
    whole = (reason == 0).all(axis=2)
    solution = np.full((*d.shape[:2], d.shape[3], d.shape[2]), complex(np.nan, np.nan))
    cross = d @ _star(r)
    square = cross.shape[2] == cross.shape[3]
    every = bool(whole.all())
    some = (cross, r) if every else (cross[whole], r[whole])
    if some[0].size:
        inverse = np.linalg.inv(some[0]) if square else np.linalg.pinv(some[0])
        solved = _star(some[1]) @ inverse
        if every:
            return np.asarray(solved)
        solution[whole] = solved
    part = ~whole & (reason != 1).all(axis=2)
    if part.any():
        seen = kept[part] @ d[part]
        # Of all lines: a row that is zero but for rounding at one line must not become as large as the others.
        size = np.sqrt(np.mean(np.abs(d) ** 2, axis=(1, 3)))
        unit = np.broadcast_to((1 / np.where(size > 0, size, 1.0))[:, np.newaxis], reason.shape)[part]
        inverse = np.linalg.pinv((unit[..., None] * seen) @ _star(r[part]), rcond=_RANK)
        columns = _star(r[part]) @ inverse * unit[:, None, :]
        solution[part] = np.where((reason[part] == 0)[:, None, :], columns, np.nan)
    return solution
