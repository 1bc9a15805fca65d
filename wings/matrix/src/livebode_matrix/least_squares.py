"""Weighted least squares of a model of all entries, with ε and the covariance of its parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import needing, normal_quantile
from livebode.dataclass import dataclass
from livebode_matrix.whitening import WeightedMatrix, stacked

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
        Of the parameters, with the scatter of estimated weights, and with errors that are alike at neighbouring lines.
    independent
        The covariance with lines that are independent.
    epsilon
        Model error as a share of each entry, 0 where noise explains the residuals.
    chi2, dof
        Sum of squares by noise alone, and its expectation for a true model.
    error
        Measured minus model, shape (lines, entries).
    """

    values: Floats
    covariance: Floats
    independent: Floats
    epsilon: float
    chi2: float
    dof: float
    error: Complex
    settled: bool


def minimise(weighted: WeightedMatrix, model: Model, slopes: Model, start: Floats) -> MatrixMinimum:
    """Fit from a start near the minimum, and again with the ε with which reduced chi² is 1."""
    dof = float(max(weighted.count - start.size, 1))
    epsilon, values, settled = 0.0, start, False
    for _ in range(_ROUNDS):
        values, settled = _searched(weighted, model, slopes, weighted.part(epsilon)[0], values)
        response = model(values)
        before, epsilon = epsilon, _epsilon(weighted, response, dof)
        if abs(epsilon - before) <= _SAME * epsilon:
            break
    inverse, share = weighted.part(epsilon)
    response, whole = model(values), inverse @ slopes(values)
    alone = _inverse(stacked(whole).reshape(-1, start.size))
    covariance = _over_lines(weighted, inverse, whole, alone) if np.isfinite(alone).all() else alone
    chi2 = _chi2(_rest(weighted, response, weighted.part(0.0)[0]))
    widened = 1 + (weighted.scatter - 1) * share
    return MatrixMinimum(
        values, covariance * widened, alone * widened, epsilon, chi2, dof, weighted.value - response, settled
    )


def _inverse(slope: Floats) -> Floats:
    """(AᵀA)⁻¹ of A with the parameters as columns; infinite where it is singular."""
    scale = np.linalg.norm(slope, axis=0) + 1e-300
    try:
        return np.asarray(np.linalg.inv((slope / scale).T @ (slope / scale)) / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        return np.full((scale.size, scale.size), np.inf)


def _over_lines(weighted: WeightedMatrix, inverse: Complex, whole: Complex, alone: Floats) -> Floats:
    """Covariance of the parameters with errors that are alike at neighbouring lines, of weighted slopes `whole`.

    The errors that the rows of the recording show are taken through the fit. Products of lines that are further apart
    count less and from a distance on nothing, which bounds their scatter and gives a covariance without negative
    eigenvalues (Newey and West, Econometrica 55(3), 1987); the distance grows with the cube root of the lines. A model
    error is independent from line to line. Few rows make Student's distribution of it, widest for a parameter that few
    lines determine. `alone` is the covariance without this, and the result if there are no rows.
    """
    errors = len(weighted.scattered)
    if not errors:
        return alone
    influence = 2 * np.einsum("kep,pq->keq", whole.conj(), alone)  # of weighted errors on the parameters
    noise = inverse @ np.linalg.inv(weighted.part(0.0)[0])  # whitened noise, as the weights with ε see it
    by_noise = np.swapaxes(noise, 1, 2) @ influence
    each = np.einsum("rke,kep->rkp", weighted.scattered, by_noise)
    lines = np.arange(each.shape[1])
    counts = np.maximum(1 - np.abs(lines[:, np.newaxis] - lines) / (np.ceil(np.cbrt(lines.size)) + 1), 0)
    total = np.einsum("rkp,kl,rlq->pq", each, counts, each.conj(), optimize=True).real / (2 * errors)
    of_noise = np.einsum("kep,keq->pq", by_noise, by_noise.conj()).real / 2
    # Degrees of freedom (Satterthwaite's) of a sum of products of lines, each with this power.
    power = np.einsum("kep,kep->kp", by_noise, by_noise.conj()).real
    freedom = 2 * errors * power.sum(axis=0) ** 2 / np.einsum("kp,kl,lp->p", power, counts**2, power, optimize=True)
    with needing("SciPy", "analysis", "a fit of matrices"):
        from scipy.special import stdtrit
    few = stdtrit(freedom, 0.975) / normal_quantile(0.975)
    return np.asarray((total + alone - of_noise) * np.outer(few, few))


def _searched(
    weighted: WeightedMatrix, model: Model, slopes: Model, inverse: Complex, start: Floats
) -> tuple[Floats, bool]:
    """Parameters at the minimum with these weights, and whether the search converged."""
    with needing("SciPy", "analysis", "a fit of matrices"):
        from scipy.optimize import least_squares

    def rest(x: Floats) -> Floats:
        return stacked(_rest(weighted, model(x), inverse)).ravel()

    def jacobian(x: Floats) -> Floats:
        return -stacked(inverse @ slopes(x)).reshape(-1, x.size)

    with np.errstate(all="ignore"):
        solution = least_squares(
            rest, start, jacobian, method="lm", x_scale="jac", max_nfev=_EVALUATIONS, xtol=_TOLERANCE,
            ftol=_TOLERANCE, gtol=_TOLERANCE,
        )  # fmt: skip
    return np.asarray(solution.x), bool(solution.success)


def _rest(weighted: WeightedMatrix, response: Complex, inverse: Complex) -> Complex:
    return np.asarray(np.einsum("kij,kj->ki", inverse, weighted.value - response))


def _chi2(residual: Complex) -> float:
    return 2 * float(np.sum(np.abs(residual) ** 2))


def _epsilon(weighted: WeightedMatrix, response: Complex, dof: float) -> float:
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
