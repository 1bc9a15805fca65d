"""Moments of line spectra over periods, forgotten exponentially, one set for each place in the period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MEANS, _PLANES = 9, 13
_SEVERAL = 1e-9  # Σv − Σv²/Σv is exactly 0 for one window, but for rounding


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted moments of line spectra, one row for each place in the period or each moment in time.

    Numerator and denominator are those of the estimate, each times conj(reference). The weights are λ^i over the
    windows i that were taken in, the newest first.

    Attributes
    ----------
    planes
        Real, shape (13, rows, lines): means of the real and imaginary parts of numerator, denominator and reference
        (6) and of three powers (3); then Σλ^i|δnum|², Σλ^i|δden|² and Σλ^i·δnum·conj(δden) (real, imaginary) with δ the
        deviation from the mean. One array, so that a period is taken in by few calls.
    rows
        Shape (6, rows): Σλ^i, Σλ^2i, Σλ^3i; means of the window centre's time and schedule; number of the oldest
        sample.
    """

    planes: Floats
    rows: Floats

    @classmethod
    def zeros(cls, rows: int, lines: int) -> Moments:
        return cls(np.zeros((_PLANES, rows, lines)), np.zeros((6, rows)))

    def at(self, rows: slice) -> Moments:
        """These rows, as views."""
        return Moments(self.planes[:, rows], self.rows[:, rows])

    def put(self, rows: slice, other: Moments) -> None:
        """Write `other` over these rows."""
        self.planes[:, rows], self.rows[:, rows] = other.planes, other.rows

    @property
    def mean(self) -> Complex:
        """Means of numerator, denominator and reference, shape (3, rows, lines)."""
        return np.asarray(self.planes[0:6:2] + 1j * self.planes[1:6:2])

    @property
    def power(self) -> Floats:
        """Means of the powers, shape (3, rows, lines)."""
        return self.planes[6:_MEANS]

    @property
    def weight(self) -> Floats:
        """Σλ^i, shape (rows,); 0 before the first window."""
        return np.asarray(self.rows[0])

    @property
    def moment(self) -> Floats:
        """Means of time and schedule, shape (2, rows)."""
        return self.rows[3:5]

    @property
    def first(self) -> NDArray[np.int64]:
        """Number of the oldest sample that went in, shape (rows,)."""
        return np.asarray(self.rows[5], dtype=np.int64)

    @property
    def unbiased(self) -> Floats:
        """What a scatter is to be divided by for the variance of one window, shape (rows,); NaN for less than two."""
        one, two, _ = self.rows[:3]
        with np.errstate(invalid="ignore"):
            rest = one - two / one
            return np.where(rest > _SEVERAL, rest, np.nan)

    @property
    def of_mean(self) -> Floats:
        """Variance of the weighted mean over that of one window, shape (rows,)."""
        return np.asarray(self.rows[1] / self.rows[0] ** 2)

    @property
    def dof(self) -> Floats:
        """Complex degrees of freedom of a scatter, shape (rows,); NaN for fewer than two windows.

        Exactly m − 1 for m windows of equal weight; else matched in two moments, tr(M)²/tr(M²) with
        M = diag(v) − vvᵀ/Σv, v = λ^i (Satterthwaite 1946).
        """
        one, two, three = self.rows[:3]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.unbiased**2 / (two - 2 * three / one + (two / one) ** 2))

    def unexplained(self, ratio: Complex) -> Floats:
        """Σλ^i|δnum − ratio·δden|², shape (rows, lines)."""
        numerator, denominator, re, im = self.planes[_MEANS:]
        shared = ratio.real * re + ratio.imag * im
        total = numerator - 2 * shared + (ratio.real**2 + ratio.imag**2) * denominator
        return np.asarray(np.maximum(total, 0.0))  # what rounding leaves below zero is zero


class PeriodMoments:
    """Running Moments: windows one period apart are one series, so that every hop has its own past.

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
        Whether the moments that go with a window include it. A window that is judged by the scatter of the others
        must not: as an outlier it would widen its own bound.
    """

    def __init__(self, places: int, lines: int, forgetting: float, *, own: bool) -> None:
        self._own = own
        self._forgetting = forgetting
        self._decay = forgetting ** np.array([[1.0], [2.0], [3.0]])
        self.now = Moments.zeros(places, lines)

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {"planes": self.now.planes.copy(), "rows": self.now.rows.copy()}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self.now.planes[...], self.now.rows[...] = state["planes"], state["rows"]

    def update(self, place: int, spectra: Complex, power: Floats, moment: Floats, usable: NDArray[np.bool_]) -> Moments:
        """Take in windows at consecutive places from `place` on and return the Moments that go with each.

        Parameters
        ----------
        spectra, power
            Numerator, denominator, reference, and three powers, each shape (3, rows, lines).
        moment
            Time, schedule and oldest sample, shape (3, rows).
        usable
            Shape (rows,); windows that are not usable leave their place's moments as they are.
        """
        places = self.now.planes.shape[1]
        rows, lines = spectra.shape[1:]
        new = np.empty((_MEANS, rows, lines))
        new[0:6:2], new[1:6:2], new[6:] = spectra.real, spectra.imag, power
        kept = Moments.zeros(rows, lines)
        done = 0
        while done < rows:
            n = min(rows - done, places - place)
            now, new_rows = self.now.at(slice(place, place + n)), slice(done, done + n)
            if not self._own:
                kept.put(new_rows, now)
            for start, stop in _stretches(usable[done : done + n]):
                at = slice(done + start, done + stop)
                self._take(now.at(slice(start, stop)), new[:, at], moment[:, at])
            if self._own:
                kept.put(new_rows, now)
            done, place = done + n, 0
        return kept

    def _take(self, now: Moments, new: Floats, moment: Floats) -> None:
        weights, means, scatter = now.rows[:3], now.planes[:_MEANS], now.planes[_MEANS:]
        old = self._forgetting * weights[0]
        now.rows[5] = np.where(old > 0, now.rows[5], moment[2])
        weights *= self._decay
        weights += 1.0
        share = 1.0 / weights[0]
        now.rows[3:5] += (moment[:2] - now.rows[3:5]) * share
        deviation = new - means
        means += deviation * share[:, np.newaxis]
        numerator, denominator = deviation[0:2], deviation[2:4]
        squares = deviation[:4] ** 2
        straight, crosswise = numerator * denominator, numerator[::-1] * denominator
        product = np.stack(
            [squares[0] + squares[1], squares[2] + squares[3], straight[0] + straight[1], crosswise[0] - crosswise[1]]
        )
        scatter *= self._forgetting
        scatter += product * (old * share)[:, np.newaxis]


def _stretches(usable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and stop of each run of usable windows."""
    if usable.all():
        return [(0, usable.size)]
    edges = np.flatnonzero(np.diff(np.r_[False, usable, False]))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]
