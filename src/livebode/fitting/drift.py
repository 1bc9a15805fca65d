"""Whether a machine drifts during a record: a trend of the response at a line that noise does not explain."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Response, Responses, Stage, StatefulBase, sum_exceeded
from livebode.dataclass import dataclass

FALSE_ALARM = 0.01
"""Probability that a record of a machine that does not drift is reported, all lines together."""
_GROUPS_MAX = 32  # when all are full, neighbours are added: memory does not grow with the record
_GROUPS_MIN = 6  # with fewer, a trend and its scatter have too few degrees of freedom
_ROUNDING = 1e-9  # of a response
_MOVED = 1e-3  # of the largest value of the schedule
# A trend is at most so far from its middle for the share 1 - 1/e of the record, as noise from its mean within sigma.
_WITHIN_SIGMA = 1 - np.exp(-1)


@dataclass(frozen=True, eq=False)
class Drift:
    """Trend of the response over a record; shapes (lines,).

    Attributes
    ----------
    significant
        Whether the machine drifts: all lines together, at `FALSE_ALARM`.
    lines
        Lines whose own trend is significant.
    value
        Mean over the record.
    change, sigma
        Change of the response from the beginning to the end of the record and its standard deviation, unit of the
        response; NaN at lines with fewer than six groups of windows.
    spread
        Part of the standard deviation of a mean over the record that the trend adds: the mean then covers the response
        at a random moment of the record as often as noise; 0 unless `significant`. Of averages with forgetting it is
        that of the periods that the newest one remembers.
    """

    significant: bool
    lines: Flags
    value: Complex
    change: Complex
    sigma: Floats
    spread: Floats


class DriftTest(StatefulBase):
    """Tests responses, in order, for a trend.

    Windows that do not overlap are averaged in up to 32 groups of equal length. At each line a parabola over time is
    fitted to the groups, for the change as its straight part, and for the largest distance from the mean. Without
    drift, the power of the straight part over that of the residuals is F(2, 2d), with d the number of groups less
    three, so that its probability is (1 + F/d)^-d. A record is significant if one line has less than half of
    `FALSE_ALARM` after Bonferroni, or all lines together have by Fisher's method.

    Responses that average over periods are turned back into the windows that they gained. Of averages Gᵢ with the mean
    times tᵢ of their windows, a window that has its centre at c and the share s of the average's weight gives
    t₂ = t₁ + s·(c − t₁) and G₂ = G₁ + s·(G − G₁), so that s and G follow; the power of the input is taken as constant.

    Parameters
    ----------
    lines
        Lines of the responses.

    Notes
    -----
    Where the schedule varies by more than a thousandth of its largest value, nothing is tested, because the response
    may depend on it. A drift that returns to its beginning has no trend. Slow noise, longer than a group, can be taken
    for drift.
    """

    _stage = Stage("drift-test", 1)
    _STATE = (
        "_windows",
        "_free",
        "_level",
        "_schedule",
        "_times_s",
        "_pairs",
        "_begin",
        "_average",
        "_value",
        "_share",
    )

    def __init__(self, lines: Lines) -> None:
        self._window, self._rate_hz, n = lines.window, lines.rate_hz, len(lines)
        self._windows, self._free, self._level = 0, 0, 0
        self._schedule = np.full(2, np.nan)  # smallest and largest
        self._times_s = np.zeros((1, _GROUPS_MAX, n))  # sums over the valid windows
        self._pairs = np.zeros((3, _GROUPS_MAX, n), dtype=np.complex128)  # number, sums of numerator and denominator

        self._begin = np.full(3, np.nan)  # first and newest sample, and time, of the first window
        self._average = np.full(2, np.nan)  # time and schedule of the newest average
        self._value = np.full(n, complex(np.nan, np.nan))  # of that
        self._share = 1.0  # of the newest window in that

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        single = part.sample - part.first < self._window
        if self._share == 1:
            self._add_windows(part, np.flatnonzero(single))
        gained = ~single & (part.first == self._begin[0])
        if gained.any():
            self._add_gained(part[gained])

    def _add_windows(self, part: Responses, single: NDArray[np.intp]) -> None:
        """Add those of the responses `single`, each of one window, that do not overlap."""
        first, after = part.first[single], part.sample[single] + 1
        index, following = int(np.searchsorted(first, self._free)), np.searchsorted(first, after).tolist()
        places: list[int] = []
        while index < len(following):
            places.append(index)
            index = following[index]
        if places:
            self._free = int(after[places[-1]])
            chosen = single[places]
            valid, weight = part.valid[chosen], part.weight[chosen]
            if np.isnan(self._begin[0]) and (some := valid.any(axis=1)).any():
                self._begin_with(part[int(chosen[np.argmax(some)])])
            weight = np.where(np.isfinite(weight), weight, 1.0)
            value = np.where(valid, part.value[chosen], np.nan)
            self._add(part.time_s[chosen], part.schedule[chosen], value, weight)

    def _begin_with(self, window: Response) -> None:
        self._begin = np.array([window.first, window.sample, window.time_s])
        self._average = np.array([window.time_s, window.schedule])
        self._value = np.where(window.valid, window.value, np.nan)

    def _add_gained(self, averages: Responses) -> None:
        """Add the windows that these averages gained, all at one place in the period."""
        moments, values = [], []
        for average in averages:
            centre_s = self._begin[2] + (average.sample - self._begin[1]) / self._rate_hz
            now = np.array([average.time_s, average.schedule])
            share = (now[0] - self._average[0]) / (centre_s - self._average[0])
            if share <= 0:  # a window that was excluded
                continue
            value = np.where(average.valid, average.value, np.nan)
            moments.append(self._average + (now - self._average) / share)
            values.append(self._value + (value - self._value) / share)
            self._average, self._value, self._share = now, value, float(share)
        if values:
            time_s, schedule = np.array(moments).T
            self._add(time_s, schedule, np.array(values), np.ones((len(values), self._value.size)))

    def _add(self, time_s: Floats, schedule: Floats, value: Complex, weight: Complex | Floats) -> None:
        """Add windows; `value` is NaN where it is invalid, shape (windows, lines)."""
        low, high = np.fmin.reduce(schedule), np.fmax.reduce(schedule)
        self._schedule = np.array([np.fmin(self._schedule[0], low), np.fmax(self._schedule[1], high)])
        used = np.isfinite(value)
        times_s = np.where(used, time_s[:, np.newaxis], 0.0)
        pairs = np.where(used, np.stack([np.ones_like(value), value * weight, weight + 0j]), 0)
        done = 0
        while done < len(value):
            if self._windows >> self._level == _GROUPS_MAX:
                self._merge()
            group = self._windows >> self._level
            stop = min(done + ((group + 1) << self._level) - self._windows, len(value))
            self._times_s[:, group] = _added(self._times_s[:, group], times_s[np.newaxis, done:stop])
            self._pairs[:, group] = _added(self._pairs[:, group], pairs[:, done:stop])
            self._windows += stop - done
            done = stop

    def _merge(self) -> None:
        for sums in (self._times_s, self._pairs):
            half = sums[:, ::2] + sums[:, 1::2]
            sums[:, : _GROUPS_MAX // 2] = half
            sums[:, _GROUPS_MAX // 2 :] = 0
        self._level += 1

    def result(self) -> Drift:
        """The test on all responses up to now."""
        n = self._pairs.shape[2]
        change, sigma = np.full(n, complex(np.nan, np.nan)), np.full(n, np.nan)
        log_chance, farthest = np.zeros(n), np.zeros(n)
        moved = np.ptp(self._schedule) > _MOVED * np.abs(self._schedule).max()
        for i in range(0 if moved else n):
            if (trend := self._trend(i)) is not None:
                change[i], sigma[i], farthest[i], log_chance[i] = trend
        own = log_chance < np.log(FALSE_ALARM / 2 / max(n, 1))
        together = sum_exceeded(n, -float(log_chance.sum())) < FALSE_ALARM / 2
        significant = bool(own.any() or together)
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self._pairs[1].sum(axis=0) / self._pairs[2].sum(axis=0)
        remembered = min(1.0, 1 / self._share / max(self._windows, 1)) if self._share < 1 else 1.0
        return Drift(significant, own, value, change, sigma, _WITHIN_SIGMA * farthest * remembered * significant)

    def _trend(self, line: int) -> tuple[complex, float, float, float] | None:
        """Change over the record, its sigma, the largest distance from the mean, and ln of the probability by chance.

        None if there are too few groups.
        """
        count = self._pairs[0, :, line].real
        some = count > 0
        if np.count_nonzero(some) < _GROUPS_MIN:
            return None
        count = count[some]
        time_s = self._times_s[0, some, line] / count
        value = self._pairs[1, some, line] / self._pairs[2, some, line]
        centred = time_s - time_s.mean()
        q, r = np.linalg.qr(np.vander(centred, 3, increasing=True) * np.sqrt(count)[:, np.newaxis])
        rotated = q.T @ (value * np.sqrt(count))
        dof = len(count) - 3
        residual = float(np.sum(np.abs(value * np.sqrt(count) - q @ rotated) ** 2)) / dof
        residual += _ROUNDING**2 * float(np.mean(count * np.abs(value) ** 2))
        if residual == 0:
            return None
        # The groups are centred on their windows; the record is one group longer.
        longer = len(count) / (len(count) - 1)
        size = float(np.ptp(time_s)) * longer / r[1, 1]
        away = q[:, 1:] @ rotated[1:] / np.sqrt(count)
        log_chance = -dof * float(np.log1p(abs(rotated[1]) ** 2 / residual / dof))
        return complex(rotated[1] * size), abs(size) * residual**0.5, float(np.abs(away).max()) * longer, log_chance

    @property
    def _identity(self) -> str:
        return f"{self._window}"


def _added(sums: NDArray[Any], rows: NDArray[Any]) -> NDArray[Any]:
    """Sums, shape (kinds, lines), and rows of shape (kinds, rows, lines), added one after the other: as if they came
    one by one, to the bit."""
    return np.asarray(np.add.reduce(np.concatenate([sums[:, np.newaxis], rows], axis=1), axis=1))
