"""Correlation of a residual with a signal, and its limit by chance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import needing
from livebode.dataclass import dataclass

with needing("SciPy", "analysis", "a validation"):
    from scipy import linalg, signal, stats


LIMIT = 2.17
"""Normal quantile: 97 % are within this many sigma."""
SMALL = 0.1
"""Share of the driven output: a model that misses less has a small error, even if it is significant."""

_WINDOW_SHARE = 10  # of the samples: range of lags of the residual's autocorrelation
_RANK = 1e-3  # of the largest variance of a combination of lags; below it is rounding
_SHOWS = 2.0  # times the effect of chance: an error that the chi² finds nearly always


@dataclass(frozen=True, eq=False)
class Correlation:
    """Normalised cross-correlation of a residual with one signal.

    Attributes
    ----------
    name
        Name of the signal.
    lags
        In samples, (lags,): at a positive lag the residual comes after the signal.
    value
        r(τ) = Σ ε(t + τ)·x(t)/√(Σε²·Σx²), (lags,).
    limit
        2.17 sigma at each lag, for a residual that is independent of the signal but not white, and a model with the
        covariance of the fit, (lags,).
    white_limit
        2.17/√L.
    judged
        Lags that can detect a wrong model, (lags,).
    p
        Probability that a true model's correlations at the judged lags, taken together, are as large.
    missed
        |ε|/|y|, of both only the part that follows the signal over the judged lags: relative error of the model in the
        output due to the signal, independent of other parts of the output.
    resolution
        Smallest detectable `missed`: twice the effect of chance and the fit's own error.
    """

    name: str
    lags: NDArray[np.int64]
    value: Floats
    limit: Floats
    white_limit: float
    judged: NDArray[np.bool_]
    p: float
    missed: float
    resolution: float

    @property
    def share(self) -> float:
        """Share of the judged lags inside `limit`."""
        return float(np.mean(np.abs(self.value) <= self.limit, where=self.judged))

    @property
    def white_share(self) -> float:
        """Share of the judged lags inside `white_limit`."""
        return float(np.mean(np.abs(self.value) <= self.white_limit, where=self.judged))

    @property
    def largest(self) -> float:
        """Largest absolute value at a judged lag."""
        return float(np.max(np.abs(self.value), where=self.judged, initial=0.0))


def correlation(
    name: str,
    residual: Floats,
    output: Floats,
    x: Floats,
    lags: int,
    slopes: Floats,
    covariance: Floats,
    first_judged: int,
) -> Correlation:
    """Correlation of `residual` with `x` at lags −lags … lags.

    The variance under a true model is Bartlett's, Σ ρ_ε(k)·ρ_x(k)/L: 1/L for a white residual whatever the signal's
    colour. ρ_ε is estimated with a Parzen window of a tenth of the samples. The fit's own error adds J·P·Jᵀ: the error
    of a parameter leaves a part of the signal in the residual.

    Parameters
    ----------
    residual, output, x
        Without start, offset and drift; the output as measured.
    slopes, covariance
        Of the simulated output by each parameter in its sigmas, (samples, parameters), and those parameters'
        correlation matrix.
    first_judged
        Lowest lag that can detect a wrong model; −lags for all.
    """
    count = len(residual)
    scale = np.sqrt(np.dot(residual, residual) * np.dot(x, x))
    lag = np.arange(-lags, lags + 1)
    value = _across(residual, x, lags) / scale
    moved = np.stack([_across(slope, x, lags) for slope in slopes.T], axis=1) / scale
    of_chance = _chance(residual, x, lags) / count
    spread = of_chance + moved @ covariance @ moved.T
    judged = lag >= first_judged
    own = linalg.toeplitz(_across(x, x, 2 * lags)[2 * lags :])[np.ix_(judged, judged)]
    among = spread[np.ix_(judged, judged)]
    missed, by_chance = _following(own, value[judged] * scale, among * scale**2)
    follows, _ = _following(own, _across(output, x, lags)[judged], among)
    return Correlation(
        name=name,
        lags=lag,
        value=value,
        limit=LIMIT * np.sqrt(np.diag(spread)),
        white_limit=LIMIT / np.sqrt(count),
        judged=judged,
        p=_together(value[judged], among),
        missed=missed / follows,
        resolution=_SHOWS * by_chance / follows,
    )


def own_correlation(residual: Floats, lags: int) -> tuple[Floats, float]:
    """Autocorrelation at lags 1 … lags, and the probability that a white residual's is as large (Ljung–Box)."""
    count = len(residual)
    own = _across(residual, residual, lags)[lags + 1 :] / np.dot(residual, residual)
    statistic = count * (count + 2) * np.sum(own**2 / (count - np.arange(1, lags + 1)))
    return own, float(stats.chi2.sf(statistic, lags))


def _across(later: Floats, earlier: Floats, lags: int) -> Floats:
    """Σ later(t + τ)·earlier(t) for τ = −lags … lags."""
    middle = len(earlier) - 1
    return np.asarray(signal.correlate(later, earlier, method="fft")[middle - lags : middle + lags + 1])


def _chance(residual: Floats, x: Floats, lags: int) -> Floats:
    """L times the covariance of the correlations at all lags, (2·lags + 1, 2·lags + 1), for an independent residual."""
    reach = max(len(residual) // _WINDOW_SHARE, 1)
    taper = signal.windows.parzen(2 * reach + 1)
    own = _across(residual, residual, reach) * taper / np.dot(residual, residual)
    other = _across(x, x, reach + 2 * lags) / np.dot(x, x)
    by_distance = np.correlate(other, own, mode="valid")  # at distances −2·lags … 2·lags
    index = np.arange(2 * lags + 1)
    return np.asarray(by_distance[2 * lags + index[:, np.newaxis] - index])


def _following(own: Floats, with_x: Floats, spread: Floats) -> tuple[float, float]:
    """Norm of the part that follows x, by least squares, and the norm due to a spread of the sums `with_x`."""
    size, turned = np.linalg.eigh(own)
    kept = size > _RANK * size[-1]
    turned, size = turned[:, kept], size[kept]
    by_chance = np.einsum("ik,ij,jk->k", turned, spread, turned) / size
    return float(np.sqrt(np.sum((turned.T @ with_x) ** 2 / size))), float(np.sqrt(np.sum(by_chance)))


def _together(value: Floats, spread: Floats) -> float:
    size, turned = np.linalg.eigh(spread)
    kept = size > _RANK * size[-1]
    statistic = np.sum((turned.T @ value)[kept] ** 2 / size[kept])
    return float(stats.chi2.sf(statistic, np.count_nonzero(kept)))
