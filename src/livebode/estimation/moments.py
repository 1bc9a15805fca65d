"""Moments of line spectra over periods, forgotten exponentially, one set for each place in the period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FIELDS = ("weights", "mean", "power", "scatter", "cross", "moment", "first")


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted moments of line spectra, one row for each place in the period or each moment in time.

    Numerator and denominator are those of the estimate, each times conj(reference). The weights are λ^i over the
    windows i that were taken in, the newest first.

    Attributes
    ----------
    weights
        Σλ^i, Σλ^2i, Σλ^3i, shape (3, rows).
    mean
        Means of numerator, denominator and reference, shape (3, rows, lines).
    power
        Means of what is averaged besides, shape (3, rows, lines).
    scatter, cross
        Σλ^i|δnum|² and Σλ^i|δden|², shape (2, rows, lines), and Σλ^i·δnum·conj(δden), shape (rows, lines), with δ the
        deviation from the mean.
    moment
        Means of the window centre's time and schedule, shape (2, rows).
    first
        Number of the oldest sample that went in, shape (1, rows).
    """

    weights: Floats
    mean: Complex
    power: Floats
    scatter: Floats
    cross: Complex
    moment: Floats
    first: NDArray[np.int64]

    @classmethod
    def zeros(cls, rows: int, lines: int) -> Moments:
        return cls(
            weights=np.zeros((3, rows)),
            mean=np.zeros((3, rows, lines), dtype=np.complex128),
            power=np.zeros((3, rows, lines)),
            scatter=np.zeros((2, rows, lines)),
            cross=np.zeros((1, rows, lines), dtype=np.complex128),
            moment=np.zeros((2, rows)),
            first=np.zeros((1, rows), dtype=np.int64),
        )

    def rows(self, at: slice) -> Moments:
        """These rows, as views."""
        return Moments(*(getattr(self, name)[:, at] for name in _FIELDS))

    def put(self, at: slice, other: Moments) -> None:
        """Write the rows of `other` over these."""
        for name in _FIELDS:
            getattr(self, name)[:, at] = getattr(other, name)

    @property
    def unbiased(self) -> Floats:
        """What the scatter is to be divided by for the variance of one window, shape (rows,); 0 for one window."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.weights[0] - self.weights[1] / self.weights[0])

    @property
    def of_mean(self) -> Floats:
        """Variance of the weighted mean over that of one window, shape (rows,)."""
        return np.asarray(self.weights[1] / self.weights[0] ** 2)

    @property
    def dof(self) -> Floats:
        """Complex degrees of freedom of the scatter, shape (rows,); NaN for fewer than two windows.

        Exactly m − 1 for m windows of equal weight; else matched in two moments, tr(M)²/tr(M²) with
        M = diag(v) − vvᵀ/Σv, v = λ^i (Satterthwaite 1946).
        """
        one, two, three = self.weights
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = two - 2 * three / one + (two / one) ** 2
            return np.where(self.unbiased > 1e-9, self.unbiased**2 / spread, np.nan)


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
    """

    def __init__(self, places: int, lines: int, forgetting: float) -> None:
        self._places = places
        self._forgetting = forgetting
        self._now = Moments.zeros(places, lines)

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {name: getattr(self._now, name).copy() for name in _FIELDS}

    @property
    def now(self) -> Moments:
        """The moments at every place in the period."""
        return self._now

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        for name in _FIELDS:
            getattr(self._now, name)[...] = state[name]

    def update(
        self,
        place: int,
        spectra: Complex,
        power: Floats,
        moment: Floats,
        first: NDArray[np.int64],
        usable: NDArray[np.bool_],
    ) -> Moments:
        """Take in windows at consecutive places from `place` on and return the Moments after each.

        Shapes as in Moments, but `first` and `usable` (rows,); windows that are not usable leave their place's moments
        as they are.
        """
        rows, lines = spectra.shape[1:]
        after = Moments.zeros(rows, lines)
        done = 0
        while done < rows:
            n = min(rows - done, self._places - place)
            now, new = self._now.rows(slice(place, place + n)), slice(done, done + n)
            for start, stop in _stretches(usable[new]):
                at = slice(done + start, done + stop)
                self._take(now.rows(slice(start, stop)), spectra[:, at], power[:, at], moment[:, at], first[at])
            after.put(new, now)
            done, place = done + n, 0
        return after

    def _take(self, now: Moments, spectra: Complex, power: Floats, moment: Floats, first: NDArray[np.int64]) -> None:
        forgetting = self._forgetting
        old = forgetting * now.weights[0]
        now.first[...] = np.where(old > 0, now.first, first)
        now.weights[...] = now.weights * forgetting ** np.array([[1.0], [2.0], [3.0]]) + 1.0
        share = 1.0 / now.weights[0]
        line_share, kept = share[:, np.newaxis], (old * share)[:, np.newaxis]
        deviation = spectra - now.mean
        now.mean[...] += deviation * line_share
        deviation = deviation[:2]
        now.power[...] += (power - now.power) * line_share
        now.moment[...] += (moment - now.moment) * share
        now.scatter[...] = forgetting * now.scatter + kept * (deviation.real**2 + deviation.imag**2)
        now.cross[0] = forgetting * now.cross[0] + kept * (deviation[0] * deviation[1].conj())


def _stretches(usable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and stop of each run of usable windows."""
    if usable.all():
        return [(0, usable.size)]
    edges = np.flatnonzero(np.diff(np.r_[False, usable, False]))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]
