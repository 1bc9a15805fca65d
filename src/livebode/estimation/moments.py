"""Moments of line spectra over periods, forgotten exponentially, one set for each place in the period."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from livebode.core import Stage, StatefulBase

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MEANS, _SCATTER = 10, 4
_NOISE = 8  # of these: the power of the noise at detection lines
_SEVERAL = 1e-9  # Σv − Σv²/Σv is exactly 0 for one window, except for rounding


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted moments of line spectra, one row for each place in the period or each moment in time.

    Numerator and denominator are those of the estimate, each times conj(reference). The weights are λ^i over the
    windows i, the newest first.

    Attributes
    ----------
    means
        Means of the real and imaginary parts of numerator, denominator and reference (6) and of four powers (4),
        shape (10, rows, lines). Real and in one array, so that a period is added in few calls.
    scatter
        Σλ^i|δnum|², Σλ^i|δden|² and the real and imaginary part of Σλ^i·δnum·conj(δden) with δ the deviation from the
        mean, shape (4, rows, lines).
    moment
        Means of the window centre's time and schedule, and the number of the oldest sample, shape (3, rows).
    weights
        Σλ^i, Σλ^2i, Σλ^3i, shape (3, rows).
    """

    means: Floats
    scatter: Floats
    moment: Floats
    weights: Floats

    @property
    def pair(self) -> Complex:
        """Means of numerator and denominator, shape (2, rows, lines)."""
        pair = np.empty((2, *self.means.shape[1:]), dtype=np.complex128)
        pair.real, pair.imag = self.means[0:4:2], self.means[1:4:2]
        return pair

    @property
    def reference(self) -> Complex:
        """Mean of the reference, shape (rows, lines)."""
        return np.asarray(self.means[4] + 1j * self.means[5])

    @property
    def coherence(self) -> Floats:
        """γ² = |S_ry|²/(S_rr·S_yy), Nevaranta 2016, eq. (18), shape (rows, lines); 1 for a single window."""
        return np.asarray((self.means[0] ** 2 + self.means[1] ** 2) / (self.means[6] * self.means[7]))

    @property
    def input_coherence(self) -> Floats:
        """The same of the denominator's signal, |S_rd|²/(S_rr·S_dd), shape (rows, lines)."""
        return np.asarray((self.means[2] ** 2 + self.means[3] ** 2) / (self.means[6] * self.means[9]))

    @property
    def repeatability(self) -> Floats:
        """|S_r|²/S_rr: the share of the reference's power that its mean has, shape (rows, lines)."""
        return np.asarray((self.means[4] ** 2 + self.means[5] ** 2) / self.means[6])

    @property
    def power(self) -> Floats:
        """Means of the powers, shape (4, rows, lines)."""
        return self.means[6:]

    @property
    def weight(self) -> Floats:
        """Σλ^i, shape (rows,); 0 before the first window."""
        return np.asarray(self.weights[0])

    @property
    def first(self) -> NDArray[np.int64]:
        """Number of the oldest sample included, shape (rows,)."""
        return np.asarray(self.moment[2], dtype=np.int64)

    @property
    def unbiased(self) -> Floats:
        """Scatter over this is the variance of one window, shape (rows,); NaN for fewer than two windows."""
        one, two, _ = self.weights
        with np.errstate(invalid="ignore"):
            rest = one - two / one
            return np.where(rest > _SEVERAL, rest, np.nan)

    @property
    def of_mean(self) -> Floats:
        """Variance of the weighted mean over that of one window, shape (rows,)."""
        return np.asarray(self.weights[1] / self.weights[0] ** 2)

    @property
    def dof(self) -> Floats:
        """Complex degrees of freedom of a scatter, shape (rows,); NaN for fewer than two windows.

        Exactly m − 1 for m windows of equal weight; else matched in two moments, tr(M)²/tr(M²) with
        M = diag(v) − vvᵀ/Σv, v = λ^i (Satterthwaite 1946).
        """
        one, two, three = self.weights
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.unbiased**2 / (two - 2 * three / one + (two / one) ** 2))

    def rows(self, at: NDArray[np.int64]) -> Moments:
        """Some of the rows."""
        return Moments(*(np.take(part, at, axis=1) for part in (self.means, self.scatter, self.moment, self.weights)))

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
    own
        Whether the moments of a window include the window itself. They must not where the scatter of the others is
        its bound: an outlier would widen its own bound.
    """

    _stage = Stage("period-moments", 1)
    _STATE = ("_count", "_means", "_scatter", "_moment")

    def __init__(self, places: int, lines: int, forgetting: float, *, own: bool) -> None:
        self._own = own
        self._weights = weights_of(forgetting)
        self._count = np.zeros(places, dtype=np.int64)
        self._means = np.zeros((_MEANS, places, lines))
        self._scatter = np.zeros((_SCATTER, places, lines))
        self._moment = np.zeros((3, places))

    @property
    def now(self) -> Moments:
        """The moments at every place in the period."""
        return Moments(self._means, self._scatter, self._moment, self._weights.after(self._count))

    def update(self, place: int, spectra: Complex, power: Floats, moment: Floats, usable: NDArray[np.bool_]) -> Moments:
        """Add windows at consecutive places from `place` on and return the Moments for each.

        Parameters
        ----------
        spectra, power
            Numerator, denominator, reference, shape (3, rows, lines), and four powers, shape (4, rows, lines): of
            reference and output (for the coherence), of the noise at detection lines, and of the denominator's signal.
        moment
            Time, schedule and oldest sample, shape (3, rows).
        usable
            Shape (rows,); unusable windows do not change the moments of their place.
        """
        parts = _parts(place, self._count.size, usable)
        before, after = self._counts(parts, usable.size)
        share, kept = self._weights.shares(after)
        new = np.empty((_MEANS, *spectra.shape[1:]))
        new[0:6:2], new[1:6:2], new[6:] = spectra.real, spectra.imag, power
        means, deviation = self._take_means(parts, new, share)
        products = _products(deviation) * kept[:, np.newaxis]
        scatter = self._take_scatter(parts, products)
        moment = self._take_moment(parts, moment, share)
        return Moments(means, scatter, moment, self._weights.after(after if self._own else before))

    def copy(self) -> PeriodMoments:
        """The same moments, which are updated on their own."""
        other = copy(self)
        other._count, other._means = self._count.copy(), self._means.copy()
        other._scatter, other._moment = self._scatter.copy(), self._moment.copy()
        return other

    def _counts(self, parts: list[_Part], rows: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Number of windows added at the place of each row, without and with this row."""
        before, after = np.empty(rows, dtype=np.int64), np.empty(rows, dtype=np.int64)
        for places, at, usable in parts:
            before[at] = self._count[places]
            self._count[places] += usable
            after[at] = self._count[places]
        return before, after

    def _take_means(self, parts: list[_Part], new: Floats, share: Floats) -> tuple[Floats, Floats]:
        kept, deviation = np.empty_like(new), np.zeros_like(new)
        column = share[:, np.newaxis]
        unknown = bool(np.isnan(new[_NOISE]).any() or np.isnan(self._means[_NOISE]).any())
        for places, at, usable in parts:
            means = self._means[:, places]
            if not self._own:
                kept[:, at] = means
            if usable:
                if unknown:
                    known, now = means[_NOISE], new[_NOISE, at]
                    # A window with the start or end of the excitation has no noise estimate: the mean is of the others.
                    means[_NOISE] = np.where(np.isnan(known), now, known)
                    new[_NOISE, at] = np.where(np.isnan(now) & (column[at] < 1), means[_NOISE], now)
                np.subtract(new[:, at], means, out=deviation[:, at])
                means += deviation[:, at] * column[at]
            if self._own:
                kept[:, at] = means
        return kept, deviation

    def _take_scatter(self, parts: list[_Part], products: Floats) -> Floats:
        if self._count.size == 1 and self._weights.forgetting == 1:
            products[:, [not usable for *_, usable in parts]] = 0.0
            sums = np.cumsum(np.concatenate([self._scatter, products], axis=1), axis=1)
            self._scatter = sums[:, -1:].copy()
            return sums[:, 1:] if self._own else sums[:, :-1]
        kept = np.empty_like(products)
        for places, at, usable in parts:
            scatter = self._scatter[:, places]
            if not self._own:
                kept[:, at] = scatter
            if usable:
                scatter *= self._weights.forgetting
                scatter += products[:, at]
            if self._own:
                kept[:, at] = scatter
        return kept

    def _take_moment(self, parts: list[_Part], moment: Floats, share: Floats) -> Floats:
        if not self._own or not (moment.any() or self._moment.any()):
            return moment
        kept = np.empty_like(moment)
        for places, at, usable in parts:
            mean = self._moment[:, places]
            if usable:
                mean[2] = np.where(share[at] < 1, mean[2], moment[2, at])
                mean[:2] += (moment[:2, at] - mean[:2]) * share[at]
            kept[:, at] = mean
        return kept


class Weights:
    """Sums of the forgetting weights over c windows: Σλ^i, Σλ^2i, Σλ^3i for i < c."""

    def __init__(self, forgetting: float) -> None:
        self.forgetting = forgetting
        # Number of windows above which the weight of another one is below rounding.
        self._enough = 0 if forgetting == 1 else min(ceil(log(1e-17) / log(forgetting)), 1 << 20)
        powers = np.cumprod(np.full((3, self._enough), forgetting ** np.array([[1.0], [2.0], [3.0]])), axis=1)
        self._table = np.concatenate([np.zeros((3, 1)), np.ones((3, 1)), 1 + np.cumsum(powers, axis=1)], axis=1)

    def after(self, count: NDArray[np.int64]) -> Floats:
        """The three sums, shape (3, rows)."""
        if self.forgetting == 1:
            return np.repeat(count.astype(np.float64)[np.newaxis], 3, axis=0)
        return np.asarray(self._table[:, np.minimum(count, self._enough + 1)])

    def shares(self, count: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """With `count` windows: the newest one's share of the mean, and the share of its deviation in the scatter."""
        with np.errstate(divide="ignore"):
            share = 1 / self.after(count)[0]
        return share, 1 - share


weights_of = lru_cache(maxsize=4)(Weights)
_Part = tuple[slice, slice, bool]


def _parts(place: int, places: int, usable: NDArray[np.bool_]) -> list[_Part]:
    """Stretches of rows that lie in one period and are all usable or all not: their places, their rows, and which."""
    if places == 1:
        return [(slice(0, 1), slice(at, at + 1), bool(used)) for at, used in enumerate(usable)]
    rows = np.arange(1, usable.size)
    cut = (np.diff(usable.view(np.int8)) != 0) | ((place + rows) % places == 0)
    edges = [0, *(rows[cut]).tolist(), usable.size]
    parts = []
    for start, stop in pairwise(edges):
        at = (place + start) % places
        if stop > start:
            parts.append((slice(at, at + stop - start), slice(start, stop), bool(usable[start])))
    return parts


def _products(deviation: Floats) -> Floats:
    """|δnum|², |δden|², and δnum·conj(δden) in real and imaginary part, shape (4, rows, lines)."""
    numerator, denominator = deviation[0:2], deviation[2:4]
    squares = deviation[:4] ** 2
    straight, crosswise = numerator * denominator, numerator[::-1] * denominator
    return np.stack(
        [squares[0] + squares[1], squares[2] + squares[3], straight[0] + straight[1], crosswise[0] - crosswise[1]]
    )
