"""Whether the machine moves, as its schedule tells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STILL = 0.01  # of the schedule's largest value: a machine that remains where it is
_PER_PERIOD = 0.2  # share of the newest schedule in the remembered one: about nine periods


class Movement:
    """Compares the schedule with its mean over the periods before, at the same place in the period.

    So the motion that the excitation itself makes, which is the same in every period, does not count. A schedule that
    is not known does not move.

    Parameters
    ----------
    places
        Windows in one period.
    """

    def __init__(self, places: int) -> None:
        self._mean = np.full(places, np.nan)
        self._largest = 0.0

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {"movement": np.append(self._mean, self._largest)}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._mean[:], self._largest = state["movement"][:-1], float(state["movement"][-1])

    def process(self, place: int, schedule: Floats) -> NDArray[np.bool_]:
        """Which of these moments, at consecutive places from `place` on, belong to a machine that moves."""
        moves = np.zeros(schedule.size, dtype=np.bool_)
        if np.isnan(schedule).all():
            return moves
        largest = np.fmax.accumulate(np.r_[self._largest, np.abs(schedule)])[1:]
        self._largest = float(largest[-1])
        done = 0
        while done < schedule.size:
            at = (place + done) % self._mean.size
            n = min(schedule.size - done, self._mean.size - at)
            mean, now = self._mean[at : at + n], schedule[done : done + n]
            apart = now - mean
            moves[done : done + n] = np.abs(apart) > _STILL * largest[done : done + n]
            mean[:] = np.where(np.isnan(apart), np.where(np.isnan(now), mean, now), mean + _PER_PERIOD * apart)
            done += n
        return moves
