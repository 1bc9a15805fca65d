"""The motion that Klipper commanded, from its queue of moves with constant acceleration (trapq)."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import SourceError

MOVES_MAX = 1 << 16
"""Moves that wait for the samples of their time."""
HEADER = ("time", "duration", "start_velocity", "acceleration", "start_position", "direction")
SIDE = 3
"""Periods on each side of a time from which its acceleration is computed."""
_SECOND_DERIVATIVE = (1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90)
_AXES = 3


class Moves:
    """Moves in the order of their times; between them the machine stands."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin again."""
        self._moves = np.empty((0, 4 + _AXES))  # start, duration, velocity, acceleration, direction
        self._newest_s = -np.inf
        self.known_s = -np.inf
        """Print time up to which all moves are known."""

    def add(self, rows: object) -> float:
        """Add moves, as in `data` of Klipper's message; the print time at which the first new one begins.

        Raises
        ------
        SourceError
            If they are not moves.
        """
        moves = _checked(rows)
        moves = moves[moves[:, 0] > self._newest_s]
        if not len(moves):
            return np.inf
        self._moves = np.concatenate([self._moves, moves])[-MOVES_MAX:]
        self._newest_s = float(moves[-1, 0])
        self.known_s = float(moves[-1, 0] + moves[-1, 1])
        return float(moves[0, 0])

    def acceleration(self, first: int, numbers: int, rate_hz: float) -> Floats:
        """Commanded acceleration at so many multiples of a period, shape (3, numbers), in mm/s².

        It is the second derivative of the commanded position at seven multiples. The acceleration itself jumps, and
        samples of it would contain what is above half the rate; the position is smooth. At 1/16 of the rate the error
        is 3·10⁻⁴ of what the moves contain there.
        """
        times_s = np.asarray(np.arange(first - SIDE, first + numbers + SIDE) / rate_hz, dtype=np.float64)
        position = self._displacement(times_s)
        found = np.zeros((_AXES, numbers))
        for at, weight in enumerate(_SECOND_DERIVATIVE):
            found += weight * position[:, at : at + numbers]
        return found * rate_hz**2

    def forget(self, time_s: float) -> None:
        """Drop the moves that ended before this print time."""
        self._moves = self._moves[self._moves[:, 0] + self._moves[:, 1] >= time_s]

    def _displacement(self, time_s: Floats) -> Floats:
        """Displacement since the oldest move, shape (3, times), in mm."""
        moves = self._moves
        if not len(moves):
            return np.zeros((_AXES, time_s.size))
        duration_s, speed, acceleration, direction = moves[:, 1], moves[:, 2], moves[:, 3], moves[:, 4:]
        paths = (speed * duration_s + 0.5 * acceleration * duration_s**2)[:, None] * direction
        before = np.concatenate([np.zeros((1, _AXES)), np.cumsum(paths, axis=0)])
        at = np.searchsorted(moves[:, 0], time_s, side="right") - 1
        move = np.maximum(at, 0)
        since_s = np.where(at >= 0, np.minimum(time_s - moves[move, 0], duration_s[move]), 0.0)
        path = speed[move] * since_s + 0.5 * acceleration[move] * since_s**2
        return np.asarray((before[move] + path[:, None] * direction[move]).T)


def _checked(rows: object) -> Floats:
    try:
        moves = np.array([[*row[:4], *row[5]] for row in rows], dtype=np.float64)  # type: ignore[attr-defined]
    except (TypeError, ValueError, LookupError, OverflowError):
        raise not_moves() from None
    if moves.size == 0:
        return np.empty((0, 4 + _AXES))
    if moves.ndim != 2 or moves.shape[1] != 4 + _AXES or not np.isfinite(moves).all():
        raise not_moves()
    if (moves[:, 1] < 0).any() or (np.diff(moves[:, 0]) < 0).any():
        raise not_moves()
    return moves


def not_moves() -> SourceError:
    return SourceError(
        "value-invalid",
        f"a message of Klipper's motion_report/dump_trapq has no rows of {', '.join(HEADER)} in order",
        "check the version of Klipper",
        key="data",
    )
