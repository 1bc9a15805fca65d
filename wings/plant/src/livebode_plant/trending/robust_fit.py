"""RobustFit: linear regression that outliers do not move, with bounds that allow for correlated scatter."""

from __future__ import annotations

from functools import lru_cache
from math import inf

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing
from livebode.dataclass import dataclass

with needing("SciPy", "analysis", "a trend"):
    from scipy.fft import dct
    from scipy.stats import t


_CORRELATIONS = np.sin(np.arange(1, 12) * 0.125)  # 0.12 … 0.98, evenly by their standard error √((1 − φ²)/n)
_SHARES = np.array([0.4, 0.6, 0.8, 1.0])  # of the correlated part in the variance; the rest is white


@dataclass(frozen=True, eq=False)
class CorrelatedScatter:
    """Covariances of coefficients for several correlations of the errors, each with its probability.

    Attributes
    ----------
    probability
        Of each correlation, (correlations,).
    covariance
        Of the coefficients' errors with each, (correlations, terms, terms).
    scatter
        Standard deviation of a row.
    correlation
        Of neighbours.
    freedom
        Rows less terms.
    """

    probability: Floats
    covariance: Floats
    scatter: float
    correlation: float
    freedom: float

    @classmethod
    def of(cls, q: Floats, error: Floats) -> CorrelatedScatter:
        """Scatter from the errors of rows in the order of time, (rows,), and orthonormal terms, (rows, terms).

        An error is a process of first order with white noise, R_ij = a φ^|i−j| + (1 − a) δ_ij. The restricted
        likelihood of each φ and a (Harville, J. Am. Stat. Assoc. 72, 1977), which the terms do not bias, gives its
        probability. It is computed in the cosine transform, which makes R nearly diagonal.
        """
        rows, count = q.shape
        spectrum, neighbour, prior = _processes(rows)
        terms, left = dct(q, axis=0, norm="ortho"), dct(error, norm="ortho")
        pairs = (terms[:, :, np.newaxis] * terms[:, np.newaxis, :]).reshape(rows, count * count)
        normal = (1 / spectrum @ pairs).reshape(-1, count, count)
        score = 1 / spectrum @ (terms * left[:, np.newaxis])
        explained = np.einsum("gi,gi->g", score, np.linalg.solve(normal, score[:, :, None])[..., 0])
        remainder = 1 / spectrum @ left**2 - explained
        remainder = np.maximum(remainder, np.finfo(float).tiny)
        freedom = rows - count
        likelihood = -0.5 * (np.log(spectrum).sum(axis=1) + np.linalg.slogdet(normal)[1] + freedom * np.log(remainder))
        probability = prior * np.exp(likelihood - likelihood.max())
        probability /= probability.sum()
        among = (spectrum @ pairs).reshape(-1, count, count) * (remainder / freedom)[:, np.newaxis, np.newaxis]
        return cls(
            probability, among, float(np.sqrt(probability @ remainder / freedom)), float(probability @ neighbour),
            float(freedom),
        )  # fmt: skip

    def seen_as(self, matrix: Floats) -> CorrelatedScatter:
        """Scatter of other coefficients, which are the products of a matrix with these."""
        other = matrix @ self.covariance @ matrix.T
        return CorrelatedScatter(self.probability, other, self.scatter, self.correlation, self.freedom)

    def p(self, contrast: Floats, value: float) -> float:
        """Probability of a combination at least as far from zero if the truth is zero, from the mean of the variances.

        Of all changes that were searched for, the probability is that of a value far from zero. There the distribution
        of `error` is too heavy: it would hide jumps that are five times their error.
        """
        (own,) = self._variances(contrast[np.newaxis]).T
        return float(2 * t.sf(abs(value) / np.sqrt(self.probability @ own), self.freedom))

    def error(self, contrasts: Floats) -> tuple[Floats, Floats]:
        """Scale and degrees of freedom of Student's distribution for each combination, (combinations, terms) in.

        The logarithm of its variance has the mean and the variance of those with the single correlations.
        """
        own = self._variances(contrasts)
        logarithm = np.log(np.maximum(own, np.finfo(float).tiny))
        mean = self.probability @ logarithm
        spread = self.probability @ (logarithm - mean) ** 2 + 2 / self.freedom + 2 / self.freedom**2
        # Of the logarithm of ν/χ², mean and variance are 1/ν and 2/ν + 2/ν², to second order.
        freedom = (1 + np.sqrt(1 + 2 * spread)) / spread
        return np.exp((mean + 1 / self.freedom - 1 / freedom) / 2), freedom

    def _variances(self, contrasts: Floats) -> Floats:
        """Variance of each combination with each correlation, (correlations, combinations)."""
        return np.asarray(np.einsum("ci,gij,cj->gc", contrasts, self.covariance, contrasts, optimize=True))


@lru_cache(maxsize=64)
def _processes(rows: int) -> tuple[Floats, Floats, Floats]:
    """Spectrum in the cosine transform, (processes, rows), correlation of neighbours, and prior probability."""
    phi, share = (each.ravel() for each in np.meshgrid(_CORRELATIONS, _SHARES, indexing="ij"))
    phi, share = np.append(0.0, phi), np.append(1.0, share)
    angle = np.pi * np.arange(rows) / rows
    first_order = (1 - phi**2)[:, None] / (1 - 2 * phi[:, None] * np.cos(angle) + (phi**2)[:, None])
    spectrum = (1 - share)[:, None] + share[:, None] * first_order
    prior = np.append(0.5, np.full(phi.size - 1, 0.5 / (phi.size - 1)))  # as probable without correlation as with it
    return spectrum, share * phi, prior


with needing("SciPy", "analysis", "a trend"):
    from scipy.linalg import solve_triangular
    from scipy.stats import t


_BISQUARE = 4.685  # of the scatter: 95 % efficiency for a normal distribution
_MAD = 1.482602  # standard deviation of a normal distribution whose median absolute deviation is 1
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
    errors
        Of the coefficients, with the correlation of the scatter.
    """

    coefficients: Floats
    residual: Floats
    weight: Floats
    scatter: float
    errors: CorrelatedScatter

    @property
    def correlation(self) -> float:
        """Correlation of the scatter of neighbours."""
        return self.errors.correlation

    def error(self, contrasts: Floats) -> Floats:
        """Standard error of each combination of the coefficients, (combinations, terms) in."""
        return self.errors.error(np.atleast_2d(contrasts))[0]

    def bound_95(self, contrasts: Floats) -> Floats:
        """95 % bound of each combination."""
        error, freedom = self.errors.error(np.atleast_2d(contrasts))
        return np.asarray(t.ppf(0.975, freedom) * error)

    def p(self, contrast: Floats) -> float:
        """Probability of a combination at least as far from zero if the truth is zero."""
        return self.errors.p(contrast, float(self.coefficients @ contrast))


def robust_fit(terms: Floats, value: Floats, sigma: Floats) -> RobustFit:
    """The regression of `value` on the columns of `terms`, rows in the order of time.

    Least absolute deviations give a start and the scale; an M-estimate with Tukey's bisquare follows (Yohai, Ann. Stat.
    15, 1987, without his start by resampling: outliers are in the values, not in the terms). A row counts with
    1/(τ² + σ²), where τ is the scatter beyond the errors of the rows.

    The errors of the coefficients allow for scatter that is correlated in the order of the rows; see
    `CorrelatedScatter`.

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
    coefficients, weight = _bisquare(q, y, start, scale)
    left = y - q @ coefficients
    influence = _influence(left, weight, scale)
    to_q = solve_triangular(r, np.eye(count), lower=False)
    errors = CorrelatedScatter.of(q, influence).seen_as(to_q)
    return RobustFit(to_q @ coefficients, left * own, weight, errors.scatter, errors)


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
    coefficients = np.asarray(q.T @ y)
    left = np.abs(y - q @ coefficients)
    least = 1e-3 * float(np.median(left)) + _TINY * float(np.abs(y).max()) + np.finfo(float).tiny
    for _ in range(15):
        coefficients = _weighted(q, y, least / np.maximum(left, least))
        left = np.abs(y - q @ coefficients)
    return coefficients


def _bisquare(q: Floats, y: Floats, coefficients: Floats, scale: float) -> tuple[Floats, Floats]:
    weight = np.ones(len(y))
    for _ in range(_ITERATIONS):
        weight = np.clip(1 - ((y - q @ coefficients) / (_BISQUARE * scale)) ** 2, 0.0, None) ** 2
        new = _weighted(q, y, weight)
        close = float(np.abs(new - coefficients).max()) <= _CLOSE * scale
        coefficients = new
        if close:
            break
    return coefficients, weight


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


def rank_of(terms: Floats) -> int:
    """Number of columns of the terms that are not combinations of the others."""
    size = np.linalg.norm(terms, axis=0)
    return int(np.linalg.matrix_rank(terms / np.where(size > 0, size, inf), tol=1e-6))
