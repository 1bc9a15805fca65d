"""Tails and quantiles of the distributions that tracking needs, by their closed forms: loading SciPy takes longer.

F has an even numerator here, because the power of complex numbers is counted, and gamma variables are sums of a number
of exponential ones; both tails are then finite sums (Abramowitz and Stegun, 26.6.4, 26.5.1, 26.4.21, 26.7.3).
"""

from __future__ import annotations

from math import atan, exp, inf, lgamma, log, pi, sin, sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats

normal_quantile = NormalDist().inv_cdf
"""Value that a standard normal variable remains below with a probability."""

COVERAGE = 0.95
"""Probability with which every bound that is shown covers the true value.

It is the usual level of an expanded uncertainty (JCGM 100:2008, 6.2) and of a confidence interval, and so what a reader
expects of a ± that says nothing else. Detectors, and the worst case of a design, have levels of their own.
"""
INTERVAL_FACTOR = normal_quantile(0.5 + COVERAGE / 2)
"""Half-width of such an interval of a number, in standard deviations: 1.96."""
CIRCLE_FACTOR = sqrt(-log(1 - COVERAGE))
"""Radius of such a circle around a complex number, in standard deviations, where these are known exactly: 1.73."""

_SETTLED, _STEPS_MAX = 1e-13, 100  # some units in the last place, and an end where rounding keeps a step larger


def f_exceeded(value: float, numerator: int, denominator: float) -> float:
    """Probability that F exceeds `value`, with an even number of degrees of freedom in the numerator.

    >>> round(f_exceeded(4.10282, 2, 10), 6)
    0.05
    """
    return float(np.exp(_f_tail(value, denominator, _log_weights(numerator, denominator))))


def f_quantile(chance: float, numerator: int, denominator: float) -> float:
    """Value that F exceeds with this probability, with an even number of degrees of freedom in the numerator.

    By Newton's method in the logarithms of value and chance, where the tail is concave: it converges from any start.

    >>> round(f_quantile(0.05, 2, 10), 5)
    4.10282
    """
    a, b = numerator / 2, denominator / 2
    weights = _log_weights(numerator, denominator)
    scale = lgamma(a + b) - lgamma(a) - lgamma(b)
    logarithm = 0.0
    for _ in range(_STEPS_MAX):
        value = exp(logarithm)
        tail = _f_tail(value, denominator, weights)
        share = a * value / (a * value + b)
        log_density = scale + a * log(share) + b * log(b / (a * value + b))  # of the logarithm of F
        step = (tail - log(chance)) * exp(tail - log_density)
        logarithm += step
        if abs(step) <= _SETTLED:
            break
    return exp(logarithm)


def _log_weights(numerator: int, denominator: float) -> Floats:
    """Logarithms of Γ(b + j)/(Γ(b)·j!), j < a, for halves a and b of the degrees of freedom."""
    if numerator < 2 or numerator % 2:
        raise ValueError(f"{numerator} degrees of freedom in the numerator are not even")
    j = np.arange(numerator // 2 - 1)
    return np.concatenate([[0.0], np.cumsum(np.log((denominator / 2 + j) / (j + 1)))])


def _f_tail(value: float, denominator: float, log_weights: Floats) -> float:
    """Logarithm of the probability: with y = b/(b + a·F), y^b times the sum of weights times (1 − y)^j."""
    if value <= 0:
        return 0.0
    a, b = log_weights.size, denominator / 2
    terms = log_weights + np.arange(a) * log(a * value / (a * value + b))
    most = float(terms.max())
    return min(b * -float(np.log1p(a * value / b)) + most + log(float(np.exp(terms - most).sum())), 0.0)


def t_quantile(probability: float, degrees: int) -> float:
    """Value that Student's t remains below with this probability above a half.

    >>> round(t_quantile(0.95, 2), 5), round(t_quantile(0.95, 5), 5)
    (2.91999, 2.01505)
    """
    low, high = 0.0, 1.0
    while _t_between(high, degrees) < 2 * probability - 1:
        high *= 2
    while high - low > _SETTLED * high:
        middle = (low + high) / 2
        low, high = (middle, high) if _t_between(middle, degrees) < 2 * probability - 1 else (low, middle)
    return high


def _t_between(value: float, degrees: int) -> float:
    """Probability that |t| is below `value`."""
    angle = atan(value / sqrt(degrees))
    square = 1 / (1 + value * value / degrees)  # of the cosine
    odd = degrees % 2
    term = sin(angle) * (sqrt(square) if odd else 1.0)
    total = 0.0
    for j in range(1 + odd, degrees, 2):
        total += term
        term *= square * j / (j + 1)
    return 2 / pi * (angle + total) if odd else total


def sum_exceeded(count: int, total: float) -> float:
    """Probability that the sum of `count` exponential variables of mean 1 exceeds `total`.

    It is that of fewer than `count` events of a Poisson process, a sum over their number.

    >>> round(sum_exceeded(2, 4.743865), 6)
    0.05
    """
    if not 0 < total < inf:
        return float(total <= 0)
    return float(sum(exp(k * log(total) - total - lgamma(k + 1)) for k in range(count)))


def log_sum_exceeded(count: ArrayLike, total: ArrayLike) -> Floats:
    """Logarithm of `sum_exceeded` for many sums at once; 0 where a total is below its mean, `count`.

    From the largest term of the sum downwards: the terms fall at least geometrically where the total exceeds the mean.

    >>> np.exp(log_sum_exceeded([2, 2], [4.743865, 1.0])).round(6)
    array([0.05, 1.  ])
    """
    counts, totals = np.broadcast_arrays(np.asarray(count, dtype=np.int64), np.asarray(total, dtype=np.float64))
    logarithm = np.zeros(counts.shape)
    rare = totals > counts
    k, x = counts[rare], totals[rare]
    term, series = np.ones(k.size), np.ones(k.size)
    for j in range(1, int(k.max(initial=1))):
        term *= np.maximum(k - j, 0) / x
        series += term
        if (term <= np.finfo(float).eps * series).all():
            break
    kinds, index = np.unique(k, return_inverse=True)
    factorial = np.array([lgamma(order) for order in kinds])[index]
    logarithm[rare] = (k - 1) * np.log(x) - x - factorial + np.log(series)
    return logarithm
