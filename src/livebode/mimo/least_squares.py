"""Weighted least squares of a model of all entries, with ε and the covariance of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core.installing import needing
from livebode.mimo.whitening import Weighted, stacked

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Model = Callable[[Floats], Complex]
"""At parameters: the response (lines, entries), or its slopes (lines, entries, parameters)."""

_ROUNDS, _SAME = 6, 0.01
_TOLERANCE = 1e-10
_EVALUATIONS = 60
_EPSILON_MAX, _HALVINGS = 1e3, 60


@dataclass(frozen=True, eq=False)
class MatrixMinimum:
    """Where the least squares ended.

    Attributes
    ----------
    values, covariance
        Of the parameters, with the scatter of estimated weights.
    epsilon
        Model error as a share of each entry, 0 where noise explains the residuals.
    chi2, dof
        Sum of squares by noise alone, and its expectation for a true model.
    rest
        Weighted residuals, shape (lines, entries).
    """

    values: Floats
    covariance: Floats
    epsilon: float
    chi2: float
    dof: float
    rest: Complex
    settled: bool


def minimise(weighted: Weighted, model: Model, slopes: Model, start: Floats) -> MatrixMinimum:
    """Fit from a start near the minimum, and again with the ε with which reduced chi² is 1."""
    dof = float(max(weighted.count - start.size, 1))
    epsilon, found, settled = 0.0, start, False
    for _ in range(_ROUNDS):
        found, settled = _searched(weighted, model, slopes, weighted.part(epsilon)[0], found)
        response = model(found)
        before, epsilon = epsilon, _epsilon(weighted, response, dof)
        if abs(epsilon - before) <= _SAME * epsilon:
            break
    inverse, share = weighted.part(epsilon)
    response, whole = model(found), _slopes(slopes(found), inverse)
    scale = np.linalg.norm(whole, axis=0) + 1e-300
    try:
        covariance = np.linalg.inv((whole / scale).T @ (whole / scale)) / np.outer(scale, scale)
    except np.linalg.LinAlgError:
        covariance = np.full((start.size, start.size), np.inf)
    rest = _rest(weighted, response, inverse)
    chi2 = _chi2(_rest(weighted, response, weighted.part(0.0)[0]))
    widened = 1 + (weighted.scatter - 1) * share
    return MatrixMinimum(found, covariance * widened, epsilon, chi2, dof, rest, settled)


def _searched(weighted: Weighted, model: Model, slopes: Model, inverse: Complex, start: Floats) -> tuple[Floats, bool]:
    """Parameters at the minimum with these weights, and whether the search converged."""
    with needing("SciPy", "analysis", "a fit of matrices"):
        from scipy.optimize import least_squares

    def rest(x: Floats) -> Floats:
        return stacked(_rest(weighted, model(x), inverse)).ravel()

    def jacobian(x: Floats) -> Floats:
        return -_slopes(slopes(x), inverse)

    with np.errstate(all="ignore"):
        found = least_squares(
            rest, start, jacobian, method="lm", x_scale="jac", max_nfev=_EVALUATIONS, xtol=_TOLERANCE,
            ftol=_TOLERANCE, gtol=_TOLERANCE,
        )  # fmt: skip
    return np.asarray(found.x), bool(found.success)


def _rest(weighted: Weighted, response: Complex, inverse: Complex) -> Complex:
    return np.asarray(np.einsum("kij,kj->ki", inverse, weighted.value - response))


def _slopes(slope: Complex, inverse: Complex) -> Floats:
    return stacked(inverse @ slope).reshape(-1, slope.shape[2])


def _chi2(rest: Complex) -> float:
    return 2 * float(np.sum(np.abs(rest) ** 2))


def _epsilon(weighted: Weighted, response: Complex, dof: float) -> float:
    """ε ≥ 0 with chi² = dof."""

    def left(epsilon: float) -> float:
        return _chi2(_rest(weighted, response, weighted.part(epsilon)[0])) - dof

    # Three sigma of chance: noise alone explains the residuals.
    if left(0.0) <= 3 * np.sqrt(2 * dof * weighted.inflation):
        return 0.0
    low, high = 1e-9, _EPSILON_MAX
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if left(middle) > 0 else (low, middle)
        if high / low < 1.0 + _SAME / 10:
            break
    return float(np.sqrt(low * high))
