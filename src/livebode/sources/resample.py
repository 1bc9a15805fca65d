"""Samples at uneven times on a regular grid, by interpolation: to examine a recording, not to measure with it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from livebode.arrays import Floats

GAP_STEPS = 6.0
"""Steps, in the median of a clock, over which nothing is interpolated."""


class Resampler:
    """Interpolates channels of one clock at increasing times.

    Cubic, with the slope between the neighbours of each sample: samples that are close together do not amplify noise.

    Parameters
    ----------
    pieces
        Times in seconds, shape (samples,), and samples, shape (channels, samples), in order.
    step_s
        Median step of the clock.
    """

    def __init__(self, pieces: Iterator[tuple[Floats, Floats]], step_s: float) -> None:
        self._pieces, self._longest_s = pieces, GAP_STEPS * step_s
        self._time, self._data = next(pieces)

    def at(self, time_s: Floats) -> Floats:
        """Samples at these times, shape (channels, times); NaN outside the recording and in its gaps."""
        while self._time.size < 3 or self._time[-3] <= time_s[-1]:
            piece = next(self._pieces, None)
            if piece is None:
                break
            self._time = np.concatenate([self._time, piece[0]])
            self._data = np.concatenate([self._data, piece[1]], axis=1)
        found = self._interpolated(time_s)
        done = max(int(np.searchsorted(self._time, time_s[-1])) - 3, 0)
        self._time, self._data = self._time[done:], self._data[:, done:]
        return found

    def _interpolated(self, at: Floats) -> Floats:
        time, data = self._time, self._data
        if time.size < 2:
            return np.full((len(data), at.size), np.nan)
        i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
        before, after = np.maximum(i - 1, 0), np.minimum(i + 2, time.size - 1)
        step = time[i + 1] - time[i]
        s = (at - time[i]) / step
        from_, to = data[:, i], data[:, i + 1]
        rise = (to - data[:, before]) / (time[i + 1] - time[before]) * step
        rise_behind = (data[:, after] - from_) / (time[after] - time[i]) * step
        found = (1 + 2 * s) * (1 - s) ** 2 * from_ + s * s * (3 - 2 * s) * to
        found += s * (1 - s) ** 2 * rise - s * s * (1 - s) * rise_behind
        exact = (at == time[i]) | (at == time[i + 1])
        found[:, exact] = np.where(at == time[i], from_, to)[:, exact]
        outside = (s < 0) | (s > 1) | ((step > self._longest_s) & ~exact)
        found[:, outside] = np.nan
        return np.asarray(found)
