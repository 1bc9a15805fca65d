"""The effective time of a window: its centre, with the scheduling signal at that time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase


class Centre(StatefulBase):
    """Scheduling signal at the centre of each window, (N − 1)/2 samples before its newest sample.

    For an even N the centre is between two samples, and the result is their mean.
    """

    _stage = Stage("centre", 1)
    _STATE = ("_past",)

    def __init__(self, window: int) -> None:
        self._early, self._late = window // 2, (window - 1) // 2
        self._past = np.full(self._early, np.nan)

    def restart(self) -> None:
        self._past[:] = np.nan

    def at(self, schedule: Floats | None, position: NDArray[np.int64]) -> Floats:
        """Schedule at the centres of the windows that end at these positions of the next stretch, `schedule`.

        NaN without a schedule.
        """
        if schedule is None:
            return np.full(position.size, np.nan)
        known = np.concatenate([self._past, schedule])
        self._past = known[known.size - self._early :]
        return np.asarray((known[position] + known[position + self._early - self._late]) / 2)
