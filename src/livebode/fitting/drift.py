"""Whether a machine significant during a record: a trend of the response at a line that noise does not explain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Responses, Stage, StatefulBase, sum_exceeded

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
        at a random moment of the record as often as noise; 0 unless `significant`.
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
    three, so that its probability is (1 + F/d)^-d. A record significant if one line has less than half of `FALSE_ALARM`
    after Bonferroni, or all lines together have by Fisher's method.

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
    _STATE = ("_windows", "_free", "_level", "_schedule", "_times_s", "_pairs")

    def __init__(self, lines: Lines) -> None:
        self._window, n = lines.window, len(lines)
        self._windows, self._free, self._level = 0, 0, 0
        self._schedule = np.full(2, np.nan)  # smallest and largest
        self._times_s = np.zeros((1, _GROUPS_MAX, n))  # sums over the valid windows
        self._pairs = np.zeros((3, _GROUPS_MAX, n), dtype=np.complex128)  # number, sums of numerator and denominator

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        chosen: list[int] = []
        index = int(np.searchsorted(part.first, self._free))
        while index < len(part):
            chosen.append(index)
            self._free = int(part.sample[index]) + 1
            index = int(np.searchsorted(part.first, self._free))
        if chosen:
            self._add(part[np.array(chosen)])

    def _add(self, windows: Responses) -> None:
        low, high = np.fmin.reduce(windows.schedule), np.fmax.reduce(windows.schedule)
        self._schedule = np.array([np.fmin(self._schedule[0], low), np.fmax(self._schedule[1], high)])
        used = windows.valid & np.isfinite(windows.value)
        weight = np.where(np.isfinite(windows.weight), windows.weight, 1.0)
        times_s = np.where(used, windows.time_s[:, np.newaxis], 0.0)
        pairs = np.where(used, np.stack([np.ones_like(weight), windows.value * weight, weight]), 0)
        done = 0
        while done < len(windows):
            if self._windows >> self._level == _GROUPS_MAX:
                self._merge()
            group = self._windows >> self._level
            stop = min(done + ((group + 1) << self._level) - self._windows, len(windows))
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
        return Drift(significant, own, value, change, sigma, _WITHIN_SIGMA * farthest * significant)

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
