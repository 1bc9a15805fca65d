"""Windows of a record in groups of equal length: what a test for a change of the machine remembers of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Stage, StatefulBase, added
from livebode.fitting.time_course import GroupSeries

_VALUES_MAX, _GROUPS = 1 << 16, (64, 512)  # when all groups are full, neighbours are added: memory does not grow


class WindowGroups(StatefulBase):
    """Means of 64 to 512 groups of windows, the fewer, the more values a window has.

    Parameters
    ----------
    values
        Number of values of a window: one for each line, and in a matrix for each of its entries there.
    """

    _stage = Stage("window-groups", 1)
    _STATE = ("windows", "_free", "_level", "_times_s", "_pairs")

    def __init__(self, values: int) -> None:
        self.windows, self._free, self._level = 0, 0, 0
        most = int(np.clip(_VALUES_MAX // max(values, 1), *_GROUPS))
        self._groups = 1 << most.bit_length() - 1
        self._times_s = np.zeros((1, self._groups, values))  # sums over the valid windows
        self._pairs = np.zeros((3, self._groups, values), dtype=np.complex128)  # number, numerator, denominator

    def apart(self, first: NDArray[np.int64], sample: NDArray[np.int64]) -> list[int]:
        """Numbers of the windows first … sample that overlap none before them, in order; they count as added."""
        after = sample + 1
        index, following = int(np.searchsorted(first, self._free)), np.searchsorted(first, after).tolist()
        places: list[int] = []
        while index < len(following):
            places.append(index)
            index = following[index]
        if places:
            self._free = int(after[places[-1]])
        return places

    def add(self, time_s: Floats, value: Complex, weight: Complex | Floats) -> None:
        """Add windows with their weights in a mean; `value` is NaN where it is invalid, shape (windows, values)."""
        used = np.isfinite(value)
        times_s = np.where(used, time_s[:, np.newaxis], 0.0)
        pairs = np.where(used, np.stack([np.ones_like(value), value * weight, weight + 0j]), 0)
        done = 0
        while done < len(value):
            if self.windows >> self._level == self._groups:
                self._merge()
            group = self.windows >> self._level
            stop = min(done + ((group + 1) << self._level) - self.windows, len(value))
            self._times_s[:, group] = added(self._times_s[:, group], times_s[np.newaxis, done:stop])
            self._pairs[:, group] = added(self._pairs[:, group], pairs[:, done:stop])
            self.windows += stop - done
            done = stop

    def _merge(self) -> None:
        for sums in (self._times_s, self._pairs):
            half = sums[:, ::2] + sums[:, 1::2]
            sums[:, : self._groups // 2] = half
            sums[:, self._groups // 2 :] = 0
        self._level += 1

    def mean(self) -> Complex:
        """Of all windows, (values,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self._pairs[1].sum(axis=0) / self._pairs[2].sum(axis=0))

    def series(self) -> tuple[list[GroupSeries], float, float]:
        """The values by the groups in which they have windows; begin and length of the record."""
        used = self._pairs[0].real > 0
        if not used.any():
            return [], 0.0, 0.0
        patterns, of = np.unique(used, axis=1, return_inverse=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            time_s, value = self._times_s[0] / self._pairs[0].real, self._pairs[1] / self._pairs[2]
        first_s, last_s, number = np.nanmin(time_s), np.nanmax(time_s), int(used.any(axis=1).sum())
        # The groups are centred on their windows; the record is one group longer.
        half_s = float(last_s - first_s) / max(number - 1, 1) / 2
        begin_s, length_s = float(first_s) - half_s, float(last_s - first_s) + 2 * half_s
        series = []
        for number, pattern in enumerate(patterns.T):
            at = np.flatnonzero(of.ravel() == number)
            rows = np.flatnonzero(pattern)
            if rows.size and length_s > 0:
                share = (time_s[rows, at[0]] - begin_s) / length_s
                series.append(GroupSeries(at, share, self._pairs[0][rows, at[0]].real, value[np.ix_(rows, at)]))
        return series, begin_s, length_s
