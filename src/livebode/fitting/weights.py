"""Weights of lines: their noise, and the error of the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.fitting.problem import MeasuredRows
from livebode.kernel import fit_epsilon

_MANY = 1e9  # degrees of freedom of a sigma that is known


def weights(sigma: Floats, size: Floats, epsilon: Floats) -> Floats:
    """√2/√(sigma² + (ε|G|)²): residuals so weighted have a sum of squares of one each, real and imaginary apart.

    sigma (rows, lines), NaN or zero where it is not known; size |G|, (rows, lines); epsilon (rows,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # a fit that diverged has no size
        variance = np.where(sigma > 0, sigma, 0.0) ** 2 + (epsilon[:, np.newaxis] * size) ** 2
        return np.where(variance > 0, np.sqrt(2 / variance), 0.0)


def epsilon_for(residual: Floats, noise: Floats, size: Floats, dof: Floats) -> Floats:
    """ε ≥ 0 with Σ 2·residual/(noise + ε²·size) = dof, (rows,); all are squares, (rows, lines), zero where not used.

    Zero where noise alone explains the residuals: Σ 2·residual/noise ≤ dof.
    """
    return fit_epsilon(np.ascontiguousarray(residual), np.ascontiguousarray(noise), np.ascontiguousarray(size), dof)


def squares(measured: MeasuredRows, response: Complex) -> tuple[Floats, Floats, Floats]:
    """|residual|², sigma² and |G|² of the model, (rows, lines), zero where a line is not used."""
    residual = np.abs(np.where(measured.use, measured.value - response, 0.0)) ** 2
    noise = np.where(measured.use & (measured.sigma > 0), measured.sigma, 0.0) ** 2
    return residual, noise, np.where(measured.use, np.abs(response), 0.0) ** 2


def own_epsilon(measured: MeasuredRows, response: Complex, dof: Floats) -> Floats:
    """Each row's ε by its own residuals, (rows,)."""
    return epsilon_for(*squares(measured, response), dof)


def misfit(measured: MeasuredRows, response: Complex, dof: Floats, noise_dof: Floats) -> Floats:
    """−2·ln(likelihood) up to a constant, each row with its own ε, (rows,).

    Σ 2·|residual|²/v + 2·ln v with v = sigma² + (ε|G|)². A sigma of d degrees of freedom makes it Student's:
    Σ 2·(n + 1)·ln(1 + |residual|²/(n·v)) + 2·ln v, n = d/(share of noise in v)².
    """
    residual, noise, size = squares(measured, response)
    variance = noise + epsilon_for(residual, noise, size, dof)[:, np.newaxis] ** 2 * size
    return misfit_by(residual, noise, variance, noise_dof, measured.use)


def misfit_by(residual: Floats, noise: Floats, variance: Floats, noise_dof: Floats, use: NDArray[np.bool_]) -> Floats:
    """Misfit from |residual|², the share of noise in v, and v, (rows, lines)."""
    with np.errstate(all="ignore"):
        n = np.minimum(noise_dof[:, np.newaxis] / (noise / variance) ** 2, _MANY)
        n = np.where(np.isfinite(n), n, _MANY)
        each = 2 * (n + 1) * np.log1p(residual / (n * variance)) + 2 * np.log(variance)
        return np.asarray(np.sum(np.where(use, each, 0.0), axis=-1))


def lacks_more_than(epsilon: float, measured: MeasuredRows, response: Complex, dof: Floats) -> NDArray[np.bool_]:
    """Rows whose own ε is larger than this one."""
    residual, noise, size = squares(measured, response)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _reduced(residual, noise, size, np.full(len(dof), epsilon**2)) > dof


def chi_squared(residual: Floats, noise: Floats) -> Floats:
    """Σ 2·residual/noise over the lines whose noise is known, (rows,); NaN where none is."""
    known = noise > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        total = np.sum(np.where(known, 2 * residual / noise, 0.0), axis=-1)
    return np.where(known.any(axis=-1), total, np.nan)


def _reduced(residual: Floats, noise: Floats, size: Floats, square: Floats) -> Floats:
    below = noise + square[:, np.newaxis] * size
    return np.asarray(np.sum(np.where(residual > 0, 2 * residual / below, 0.0), axis=-1))
