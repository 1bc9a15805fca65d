"""Increase of the noise, from rows alone: a change of the machine is not noise."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase

_ROWS = 31  # fewer scatter so much that rows get too little variance where the noise has risen
_MEDIAN = 0.4549364  # of chi square with one degree of freedom
_BELIEVED = 3.0  # times the excess of the differences over the learned noise


class NoiseLevel(StatefulBase):
    """Limits the rows' own noise estimates by the differences of neighbouring rows.

    A response's sigma is from the scatter of periods. For some periods after a step of the machine it contains the
    step, so that rows after the step would weigh a hundredth of those before it. A step affects one difference of
    neighbouring rows; noise affects all. The median over the newest 31 rows and all components of a line shows only
    the noise. A row's noise beyond the learned one is limited to three times that median.

    Parameters
    ----------
    components
        Columns of a deviation.
    together
        Components of one line: 2, or 1 for a parameter.
    """

    _stage = Stage("noise-level", 1)
    _STATE = ("_before", "_squares")

    def __init__(self, components: int, together: int) -> None:
        self._together = together
        self._before = np.full((2, 1, components), np.nan)
        self._squares = np.full((_ROWS - 1, components), np.nan)

    def process(self, deviation: Floats, own: Floats, more: Floats) -> Floats:
        """Variance of rows from their deviation, the learned variance and their own excess, (rows, components)."""
        if not len(own):
            return own
        known = np.where(np.isfinite(own), own, np.nan)
        both = np.concatenate([self._before, np.stack([np.where(np.isfinite(own), deviation, np.nan), known])], axis=1)
        square = np.diff(both[0], axis=0) ** 2 / (both[1, 1:] + both[1, :-1])
        squares = np.concatenate([self._squares, square])
        self._before, self._squares = both[:, -1:], squares[len(square) :]
        newest = np.lib.stride_tricks.sliding_window_view(squares, _ROWS, axis=0)
        level = _median(newest.reshape(len(own), -1, self._together * _ROWS)) / _MEDIAN
        shown = np.repeat(np.maximum(level - 1.0, 0.0), self._together, axis=1)
        return np.asarray(own + np.minimum(more, np.nan_to_num(_BELIEVED * shown * known)))


def _median(values: Floats) -> Floats:
    """Median over the last axis of the known values; 0 where none is known."""
    count = np.isfinite(values).sum(axis=-1, keepdims=True)
    order = np.sort(values, axis=-1)  # NaN is sorted last
    middle = [np.take_along_axis(order, np.maximum(count - 1 + i, 0) // 2, axis=-1) for i in (0, 1)]
    return np.where(count > 0, (middle[0] + middle[1]) / 2, 0.0)[..., 0]
