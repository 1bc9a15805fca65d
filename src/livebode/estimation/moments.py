"""Moments of line spectra over periods, forgotten exponentially, one set for each place in the period."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Stage, StatefulBase
from livebode.kernel import MEANS, SCATTER, LineMoments, WeightSums


def power(spectrum: Complex) -> Floats:
    """|X|² without the square root that abs takes."""
    # As all products here by real operations, which round in one way wherever a number is in an array.
    return np.asarray(spectrum.real**2 + spectrum.imag**2)


def magnitude(spectrum: Complex) -> Floats:
    """|X|, from its power: the last bit of abs depends on the processor."""
    return np.asarray(np.sqrt(power(spectrum)))


def times(one: Complex, other: Complex) -> Complex:
    """Product by real operations: NumPy's of complex numbers rounds otherwise in the last elements of an array."""
    product = np.empty(np.broadcast_shapes(one.shape, other.shape), dtype=np.complex128)
    product.real = one.real * other.real - one.imag * other.imag
    product.imag = one.real * other.imag + one.imag * other.real
    return product


def scaled(one: Complex, factor: Floats | float) -> Complex:
    """Product with a real number."""
    product = np.empty(one.shape, dtype=np.complex128)
    product.real, product.imag = one.real * factor, one.imag * factor
    return product


def divided(one: Complex, other: Complex) -> Complex:
    """Quotient without overflow of |other|² (R. L. Smith, 1962), as NumPy divides where products are rounded."""
    a, b, c, d = one.real, one.imag, other.real, other.imag
    re, im = np.abs(c), np.abs(d)
    wide, zero = re >= im, (re == 0) & (im == 0)
    ratio = np.where(wide, d / c, c / d)
    scale = 1 / np.where(wide, c + d * ratio, d + c * ratio)
    quotient = np.empty(np.broadcast_shapes(one.shape, other.shape), dtype=np.complex128)
    quotient.real = np.where(zero, a / re, np.where(wide, a + b * ratio, a * ratio + b) * scale)
    quotient.imag = np.where(zero, b / re, np.where(wide, b - a * ratio, b * ratio - a) * scale)
    return quotient


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted moments of line spectra, one row for each place in the period or each moment in time.

    Numerator and denominator are those of the estimate, each times conj(reference). The weights are λ^i over the
    windows i, the newest first.

    Attributes
    ----------
    means, scatter
        As those of `LineMoments`, shapes (10, rows, lines) and (4, rows, lines). Real and in one array, so that a
        period is added in one pass.
    weights
        Σλ^i, Σλ^2i, Σλ^3i, each of shape (rows,).
    """

    means: Floats
    scatter: Floats
    weights: WeightSums

    @property
    def pair(self) -> Complex:
        """Means of numerator and denominator, shape (2, rows, lines)."""
        pair = np.empty((2, *self.means.shape[1:]), dtype=np.complex128)
        pair.real, pair.imag = self.means[0:4:2], self.means[1:4:2]
        return pair

    @property
    def repeatability(self) -> Floats:
        """|S_r|²/S_rr: the share of the reference's power that its mean has, shape (rows, lines)."""
        return np.asarray((self.means[4] ** 2 + self.means[5] ** 2) / self.means[6])

    @property
    def power(self) -> Floats:
        """Means of the powers, shape (4, rows, lines)."""
        return self.means[6:]

    def unexplained(self, ratio: Complex) -> Floats:
        """Σλ^i|δnum − ratio·δden|², shape (rows, lines)."""
        numerator, denominator, re, im = self.scatter
        shared = ratio.real * re + ratio.imag * im
        total = numerator - 2 * shared + (ratio.real**2 + ratio.imag**2) * denominator
        return np.asarray(np.maximum(total, 0.0))  # rounding can make it negative


class PeriodMoments(StatefulBase):
    """Running Moments: windows one period apart are one series, so that every hop has its own history.

    Means and centred second moments are updated by deviations (West 1979), since sums of squares would lose the
    scatter to rounding at a high signal-to-noise ratio.

    Parameters
    ----------
    places
        Windows in one period.
    lines
        Lines in one row.
    forgetting
        λ per period, 0 < λ ≤ 1; 1 remembers every period equally.

    Attributes
    ----------
    weights
        Sums of the forgetting weights.
    """

    _stage = Stage("period-moments", 1)
    _STATE = ("_count", "_means", "_scatter", "_moment")

    def __init__(self, places: int, lines: int, forgetting: float) -> None:
        self.weights = weights_of(forgetting)
        self._count = np.zeros(places, dtype=np.int64)
        self._means = np.zeros((MEANS, places, lines))
        self._scatter = np.zeros((SCATTER, places, lines))
        self._moment = np.zeros((3, places))

    @property
    def arrays(self) -> LineMoments:
        """The state, which the functions of the kernel change in place."""
        return LineMoments(self._count, self._means, self._scatter, self._moment)

    @property
    def now(self) -> Moments:
        """The moments at every place in the period."""
        return Moments(self._means, self._scatter, self.weights.after(self._count))

    def forget(self) -> None:
        """Return to the state before the first window."""
        for part in (self._count, self._means, self._scatter, self._moment):
            part[:] = 0


class Weights:
    """Sums of the forgetting weights over c windows: Σλ^i, Σλ^2i, Σλ^3i for i < c.

    Attributes
    ----------
    forgetting
        λ.
    table
        The sums over 0, 1, 2 … windows, as many as change them, shape (3, any).
    """

    def __init__(self, forgetting: float) -> None:
        self.forgetting = forgetting
        # Number of windows above which the weight of another one is below rounding.
        enough = 0 if forgetting == 1 else min(ceil(log(1e-17) / log(forgetting)), 1 << 20)
        powers = np.cumprod(np.full((3, enough), forgetting ** np.array([[1.0], [2.0], [3.0]])), axis=1)
        self.table = np.concatenate([np.zeros((3, 1)), np.ones((3, 1)), 1 + np.cumsum(powers, axis=1)], axis=1)

    def after(self, count: NDArray[np.int64]) -> WeightSums:
        """The sums over so many windows, shape of `count`."""
        return WeightSums.after(count, self.forgetting, self.table)


weights_of = lru_cache(maxsize=4)(Weights)
