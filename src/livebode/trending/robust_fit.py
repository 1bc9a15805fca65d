"""RobustFit: linear regression that outliers do not move, with bounds that allow for correlated scatter."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.stats import t

Floats = NDArray[np.float64]

_BISQUARE = 4.685  # of the scatter: 95 % efficiency for a normal distribution
_MAD = 1.482602  # standard deviation of a normal distribution whose median absolute deviation is 1
_CORRELATION_MAX = 0.98
_ITERATIONS, _CLOSE = 40, 1e-6
_TINY = 1e-12  # of the size of the values: scatter that is only rounding


@dataclass(frozen=True, eq=False)
class RobustFit:
    """Coefficients of a regression, and the scatter around it.

    Attributes
    ----------
    coefficients
        (terms,).
    residual
        Value − fit, (rows,).
    weight
        Share with which each row counts, 0 for an outlier, (rows,).
    scatter
        Standard deviation of a row of average accuracy around the fit.
    correlation
        Of the scatter of neighbours; increased by its own standard error and by the bias of an estimate from residuals.
    freedom
        Degrees of freedom of `scatter`, reduced by the correlation.
    covariance
        Of the coefficients' errors, (terms, terms).
    """

    coefficients: Floats
    residual: Floats
    weight: Floats
    scatter: float
    correlation: float
    freedom: float
    covariance: Floats

    def error(self, contrasts: Floats) -> Floats:
        """Standard error of each combination of the coefficients, (combinations, terms) in."""
        rows = np.atleast_2d(contrasts)
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", rows @ self.covariance, rows)))

    def bound_95(self, contrasts: Floats) -> Floats:
        """95 % bound of each combination."""
        return np.asarray(t.ppf(0.975, self.freedom) * self.error(contrasts))

    def p(self, contrast: Floats) -> float:
        """Probability of a combination at least as far from zero if the truth is zero."""
        return float(2 * t.sf(abs(float(self.coefficients @ contrast)) / float(self.error(contrast)[0]), self.freedom))


def robust_fit(terms: Floats, value: Floats, sigma: Floats) -> RobustFit:
    """The regression of `value` on the columns of `terms`, rows in the order of time.

    Least absolute deviations give a start and the scale; an M-estimate with Tukey's bisquare follows (Yohai, Ann. Stat.
    15, 1987, without his start by resampling: outliers are in the values, not in the terms). A row counts with
    1/(τ² + σ²), where τ is the scatter beyond the errors of the rows.

    The errors of the coefficients are those of a process of first order, e_i = φ e_{i−1} + ε_i, in the order of the
    rows. Residuals understate φ: it is corrected by (1 + 3φ + (p − 1)(1 + φ))/n (Kendall, Biometrika 41, 1954, extended
    to p terms) and increased by its standard error √((1 − φ²)/n). The variance is corrected for what the terms absorb.

    Biased if more than a third of the rows are outliers, or if a term has an error of its own: its coefficient is then
    too small. The bounds are too small for scatter that is correlated longer than a tenth of the rows.

    Parameters
    ----------
    terms
        (rows, terms), of full rank.
    value
        (rows,).
    sigma
        Standard deviation of the error of each row, (rows,); zero where it is not known.

    Examples
    --------
    >>> x = np.arange(40.0)
    >>> noise = np.resize([0.1, -0.1, 0.05, -0.05], 40)
    >>> value = 1 + 0.5 * x + noise + 100 * (x == 7)
    >>> fit = robust_fit(np.column_stack([np.ones(40), x]), value, np.zeros(40))
    >>> fit.coefficients.round(1), bool(fit.weight[7] == 0)
    (array([1. , 0.5]), True)
    """
    own = _own_errors(terms, value, sigma)
    q, r = np.linalg.qr(terms / own[:, np.newaxis])
    y = value / own
    rows, count = q.shape
    start = _least_absolute(q, y)
    scale = _MAD * float(np.median(np.abs(y - q @ start))) * rows / (rows - count)
    scale = max(scale, _TINY * float(np.abs(y).max()), np.finfo(float).tiny)
    at, weight = _bisquare(q, y, start, scale)
    left = y - q @ at
    influence = _influence(left, weight, scale)
    phi = _correlation(influence, count)
    among = _correlated_products(q, phi)
    variance = float(influence @ influence) / max(rows - float(among.trace()), 1.0)
    freedom = max((rows - count) * (1 - phi) / (1 + phi), 2.0)
    to_q = solve_triangular(r, np.eye(count), lower=False)
    covariance = variance * to_q @ among @ to_q.T
    return RobustFit(to_q @ at, left * own, weight, sqrt(variance), phi, freedom, covariance)


def _own_errors(terms: Floats, value: Floats, sigma: Floats) -> Floats:
    """√(τ² + σ²) of each row, relative to the median one."""
    if sigma.min() == sigma.max():
        return np.ones(len(value))
    q = np.linalg.qr(terms)[0]
    left = value - q @ _least_absolute(q, value)
    between = (_MAD * float(np.median(np.abs(left)))) ** 2 - float(np.median(sigma)) ** 2
    total = np.sqrt(max(between, 0.0) + sigma**2)
    middle = float(np.median(total))
    return np.asarray(np.maximum(total / middle, 1e-3)) if middle > 0 else np.ones(len(value))


def _least_absolute(q: Floats, y: Floats) -> Floats:
    """Least absolute deviations, by weighted least squares."""
    at = np.asarray(q.T @ y)
    left = np.abs(y - q @ at)
    least = 1e-3 * float(np.median(left)) + _TINY * float(np.abs(y).max()) + np.finfo(float).tiny
    for _ in range(15):
        at = _weighted(q, y, least / np.maximum(left, least))
        left = np.abs(y - q @ at)
    return at


def _bisquare(q: Floats, y: Floats, at: Floats, scale: float) -> tuple[Floats, Floats]:
    weight = np.ones(len(y))
    for _ in range(_ITERATIONS):
        weight = np.clip(1 - ((y - q @ at) / (_BISQUARE * scale)) ** 2, 0.0, None) ** 2
        new = _weighted(q, y, weight)
        close = float(np.abs(new - at).max()) <= _CLOSE * scale
        at = new
        if close:
            break
    return at, weight


def _weighted(q: Floats, y: Floats, weight: Floats) -> Floats:
    """Weighted least squares; a step or a bend whose rows are all outliers gets the smallest coefficients."""
    weighted = q * weight[:, np.newaxis]
    normal = weighted.T @ q
    normal.flat[:: len(normal) + 1] += 1e-12 * normal.trace()
    return np.asarray(np.linalg.solve(normal, weighted.T @ y))


def _influence(left: Floats, weight: Floats, scale: float) -> Floats:
    """What each row moves the estimate by, as the residual of least squares would (Huber, Robust Statistics, 7.6)."""
    slope = np.where(weight > 0, np.sqrt(weight) * (1 - 5 * (left / (_BISQUARE * scale)) ** 2), 0.0)
    return np.asarray(left * weight / max(float(slope.mean()), 0.1))


def _correlation(influence: Floats, count: int) -> float:
    """Correlation of neighbours, on the safe side, 0 to 0.98."""
    rows, power = len(influence), float(influence @ influence)
    if power == 0:
        return 0.0
    phi = float(influence[1:] @ influence[:-1]) / power
    phi += (1 + 3 * phi + (count - 1) * (1 + phi)) / rows
    phi += sqrt(max(1 - phi**2, 0.0) / rows)
    return min(max(phi, 0.0), _CORRELATION_MAX)


def _correlated_products(q: Floats, phi: float) -> Floats:
    """QᵀRQ, where the correlation of rows i and j is R_ij = φ^|i−j|; the sum over j < i is a filter of first order."""
    if phi == 0:
        return np.asarray(q.T @ q)
    from scipy.signal import lfilter

    before = q.T @ lfilter([0.0, phi], [1.0, -phi], q, axis=0)
    return np.asarray(q.T @ q + before + before.T)


def rank_of(terms: Floats) -> int:
    """Number of columns of the terms that are not combinations of the others."""
    size = np.linalg.norm(terms, axis=0)
    return int(np.linalg.matrix_rank(terms / np.where(size > 0, size, inf), tol=1e-6))
