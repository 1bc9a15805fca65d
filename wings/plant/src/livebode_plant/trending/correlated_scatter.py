"""CorrelatedScatter: how far the coefficients of a regression scatter if the errors of its rows are correlated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing

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
        """From the errors of rows in the order of time, (rows,), and orthonormal terms, (rows, terms).

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
        rest = 1 / spectrum @ left**2 - np.einsum("gi,gi->g", score, np.linalg.solve(normal, score[:, :, None])[..., 0])
        rest = np.maximum(rest, np.finfo(float).tiny)
        freedom = rows - count
        likelihood = -0.5 * (np.log(spectrum).sum(axis=1) + np.linalg.slogdet(normal)[1] + freedom * np.log(rest))
        probability = prior * np.exp(likelihood - likelihood.max())
        probability /= probability.sum()
        among = (spectrum @ pairs).reshape(-1, count, count) * (rest / freedom)[:, np.newaxis, np.newaxis]
        return cls(
            probability, among, float(np.sqrt(probability @ rest / freedom)), float(probability @ neighbour),
            float(freedom),
        )  # fmt: skip

    def seen_as(self, matrix: Floats) -> CorrelatedScatter:
        """Of other coefficients, which these are multiplied with to get them."""
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
        """Of each combination with each correlation, (correlations, combinations)."""
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
