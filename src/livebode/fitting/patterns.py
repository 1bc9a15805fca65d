"""Whether residuals follow a pattern over the lines, and the covariance of such a misfit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FittedRows
from livebode.fitting.weights import misfit, weights

LACKS = 10.0
"""Decrease of −2·ln(likelihood) by an ε from which noise alone does not explain the residuals."""
RUNS = 2.6
"""Sigma of the correlation of neighbours from which residuals follow a pattern: once in 200 fits by chance."""

_FEW = 16  # lines, too few for the pattern to show
_LENGTHS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # lines
_SIZES = (0.5, 1.0, 2.0, 4.0, 8.0)  # of ε
_ROUNDING = 1e-9  # of |G|: a residual below is rounding, whose neighbours correlate too; and of a matrix


def correlation(measured: MeasuredRows, fitted: FittedRows) -> float:
    """Correlation of neighbouring lines' weighted residuals, −1 … 1, of one row."""
    used = measured.use[0]
    weight = weights(measured.sigma, np.abs(fitted.response), fitted.epsilon)[0, used]
    return neighbours(weight * (measured.value - fitted.response)[0, used])


def pattern_size(measured: MeasuredRows, fitted: FittedRows) -> float:
    """Size of the part of one row's residuals that neighbouring lines share, as a share of |G|; noise may hide it."""
    used = measured.use[0]
    size = np.abs(fitted.response)[0, used]
    relative = np.abs((measured.value - fitted.response)[0, used]) / np.maximum(size, _ROUNDING * size.max())
    return float(np.sqrt(max(correlation(measured, fitted), 0.0) * np.mean(relative**2)))


def neighbours(residual: Complex) -> float:
    """Correlation of neighbours among weighted residuals (lines,); its deviation by chance is 1/√(2·lines)."""
    power = float(np.sum(np.abs(residual) ** 2))
    return float(np.sum((residual[1:] * residual[:-1].conj()).real) / power) if power > 0 else 0.0


def follows_pattern(measured: MeasuredRows, fitted: FittedRows, noise_dof: Floats) -> bool:
    """Whether the residual is not noise: neighbouring lines correlate, or there are too few lines for this test and
    noise does not explain their residuals.

    For independent lines the correlation's standard deviation is 1/√(2·lines).
    """
    lines = int(np.count_nonzero(measured.use))
    residual, size = (np.abs(x)[measured.use].max() for x in (measured.value - fitted.response, fitted.response))
    if residual < _ROUNDING * size:
        return False  # residual of the iteration for exact data
    if correlation(measured, fitted) * np.sqrt(2 * lines) > RUNS:
        return True
    known = replace(measured, use=measured.use & (measured.sigma > 0))
    if lines >= _FEW or not known.use.any():
        return False
    alone = misfit(known, fitted.response, np.full(1, np.inf), noise_dof)
    return bool((alone - misfit(known, fitted.response, fitted.dof, noise_dof))[0] > LACKS)


def covariance(problem: Problem, measured: MeasuredRows, fitted: FittedRows) -> Floats:
    """Covariance (parameters, parameters) of one row's values under a misfit that is smooth over the lines.

    The misfit is m·G with E[mᵢ·mⱼ*] = ε²·ρ(|i − j|/length), ρ Matérn's of order 3/2. Its size and length are weighted
    by the restricted likelihood of the residuals, which allows for the fitted parameters, on a grid over which the
    covariance is averaged. The values are those of the weighted fit: C = A⁻¹·Xᵀ·W·K·W·X·A⁻¹.
    """
    used = measured.use[0]
    weight = weights(measured.sigma, np.abs(fitted.response), fitted.epsilon)
    known, _ = problem.solve(measured, np.where(measured.use, weight, 0.0), fitted.values, 1)
    size = fitted.response[0, used]
    slope = (known.slope[0, used] / size[:, np.newaxis]).astype(np.complex128)
    residual = (measured.value[0, used] - size) / size
    noise = np.where(measured.sigma[0, used] > 0, measured.sigma[0, used], 0.0) ** 2 / np.abs(size) ** 2
    scale = np.sqrt(np.sum(np.abs(slope) ** 2, axis=0))
    slope = slope / scale
    epsilon = max(float(fitted.epsilon[0]), _ROUNDING)
    pull = _pull(slope, noise + epsilon**2)
    covariances, likely = [], []
    for length in _LENGTHS:
        smooth = _smooth(len(size), length)
        for factor in _SIZES:
            both = np.diag(noise) + (factor * epsilon) ** 2 * smooth
            likely.append(_restricted(both, slope, residual))
            covariances.append((pull @ both @ pull.conj().T).real / 2)
    share = np.exp(-(np.array(likely) - min(likely)) / 2)
    inner = np.tensordot(share / share.sum(), np.array(covariances), axes=1) / np.outer(scale, scale)
    outward = problem.outward_slopes(fitted.values)[0]
    free = np.flatnonzero(problem.free)
    whole = np.zeros((fitted.values.shape[1],) * 2)
    whole[np.ix_(free, free)] = np.outer(outward, outward) * inner
    return whole


def _pull(slope: Complex, variance: Floats) -> Complex:
    """(parameters, lines): change of the parameters by each line's error, as a share of |G|."""
    weighted = slope.conj().T / variance
    return np.asarray(np.linalg.pinv((weighted @ slope).real, rcond=_ROUNDING) @ weighted)


def _smooth(lines: int, length: float) -> Floats:
    apart = np.sqrt(3) * np.abs(np.subtract.outer(np.arange(lines), np.arange(lines))) / length
    return np.asarray((1 + apart) * np.exp(-apart))


def _restricted(both: Floats, slope: Complex, residual: Complex) -> float:
    """−2·ln of the restricted likelihood of residuals with this covariance, half of it in each of their two parts."""
    lower = np.linalg.cholesky(both + _ROUNDING * np.trace(both) / len(both) * np.eye(len(both)))
    x, y = (np.sqrt(2) * _stacked(np.asarray(np.linalg.solve(lower, part))) for part in (slope, residual))
    basis, triangle = np.linalg.qr(x)
    left = y - basis @ (basis.T @ y)
    about = 2 * np.sum(np.log(np.abs(np.diag(triangle)) + 1e-300))
    return float(4 * np.sum(np.log(np.diag(lower))) + about + left @ left)


def _stacked(values: Complex) -> Floats:
    return np.concatenate([values.real, values.imag])
