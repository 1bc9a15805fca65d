"""Detects from the schedule whether the machine moves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Flags, Floats
from livebode.core import Stage, StatefulBase

PLACES = 20  # of a period that are looked at
_PERIODS = 9  # before, with which the schedule is compared
_BEFORE = _PERIODS + 2  # that are remembered: the oldest value with a bend needs two more
_BENDS_MIN = 6  # second differences without which the jitter is not known
_JITTER = 3.0  # times the largest second difference: what noise and a flickering count do not reach
_FEW = 8  # places: with fewer, second differences miss vibration, so that twice as many times their size count


class Movement(StatefulBase):
    """Compares the schedule with the nine previous periods, at the same place in the period.

    So the motion due to the excitation itself, which is the same in every period, has no effect. The machine moves
    where the schedule is farther from one of these than three times its jitter: the largest second difference of values
    that follow each other, over the same time. That depends on no offset and no unit; noise, a count that flickers and
    a drift that stays within them are no motion. An unknown schedule counts as not moving.

    With fewer than eight places in a period it is six times. With a single one it takes eight periods to know the
    jitter, and strokes of less than 14 periods have second differences as large as they are, and are not seen.

    Parameters
    ----------
    places
        Windows in one period; of many at most twenty are looked at, and what is found counts until the next.
    """

    _stage = Stage("movement", 1)
    _STATE = ("_past", "_next", "_moves")

    def __init__(self, places: int) -> None:
        self._places, self._stride = places, -(-places // PLACES)
        self._past = np.full((_BEFORE + 1, -(-places // self._stride)), np.nan)  # newest last, perhaps in part
        self._next, self._moves = 0, False
        self._times = _JITTER if places >= _FEW else 2 * _JITTER

    def process(self, place: int, schedule: Floats) -> Flags:
        """Which of these moments, at consecutive places from `place` on, belong to a machine that moves."""
        if np.isnan(schedule).all() and np.isnan(self._past).all():
            return np.zeros(schedule.size, dtype=np.bool_)
        places = place + np.arange(schedule.size)
        looked = np.flatnonzero(places % self._places % self._stride == 0)
        moves = np.empty(schedule.size + 1, dtype=np.bool_)
        moves[0] = self._moves
        moves[looked + 1] = self._look(places[looked], schedule[looked])
        newest = np.zeros(moves.size, dtype=np.int64)
        newest[looked + 1] = looked + 1
        moves = moves[np.maximum.accumulate(newest)][1:]
        self._moves = bool(moves[-1])
        return moves

    def _look(self, places: NDArray[np.int64], schedule: Floats) -> Flags:
        if not places.size:
            return np.zeros(0, dtype=np.bool_)
        row, column = places // self._places - places[0] // self._places, places % self._places // self._stride
        row = row + _BEFORE + int(column[0] < self._next)
        periods = np.full((int(row[-1]) + 1, self._past.shape[1]), np.nan)
        periods[: _BEFORE + 1] = self._past
        periods[row, column] = schedule
        self._past, self._next = periods[-_BEFORE - 1 :].copy(), int(column[-1]) + 1
        return np.asarray(_moving(periods, self._times)[row - _BEFORE, column])


def _moving(periods: Floats, times: float) -> Flags:
    """Times of motion from the schedule in consecutive periods, (periods, places), relative to the previous ones."""
    now, steps = periods[_BEFORE:], np.subtract(*_ends(periods.ravel()))
    bends = np.full(periods.shape, np.nan)
    np.subtract(*_ends(steps), out=bends.reshape(-1)[2:])
    np.abs(bends, out=bends)
    known = np.cumsum(np.isfinite(bends), axis=1)
    jitter = np.maximum.accumulate(np.where(np.isnan(bends), 0.0, bends), axis=1)
    apart = np.fmax.reduce(np.abs(now[:, np.newaxis] - _before(periods)), axis=1)
    largest = np.maximum(jitter[_BEFORE:], _before(jitter[:, -1].copy()).max(axis=1)[:, np.newaxis])
    count = known[_BEFORE:] + _before(known[:, -1].copy()).sum(axis=1)[:, np.newaxis]
    return np.asarray((count >= _BENDS_MIN) & (apart > times * largest))


def _ends(series: Floats) -> tuple[Floats, Floats]:
    """All but the first, and all but the last."""
    return series[1:], series[:-1]


def _before(rows: NDArray[Any]) -> NDArray[Any]:
    """For each row after the remembered ones the nine before it, without a copy, (rows, 9, …)."""
    first, step = rows[_BEFORE - _PERIODS :], rows.strides[:1]
    shape = len(rows) - _BEFORE, _PERIODS, *rows.shape[1:]
    return np.ndarray(shape, rows.dtype, first, strides=step + rows.strides)
