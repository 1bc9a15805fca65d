"""The motion that Klipper commanded, from its queue of moves with constant acceleration (trapq)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import SourceError

Floats = NDArray[np.float64]

MOVES_MAX = 1 << 16
"""Moves that wait for the samples of their time."""
HEADER = ("time", "duration", "start_velocity", "acceleration", "start_position", "direction")
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
        """Mean acceleration over one period around each of so many multiples of it, shape (3, numbers), in mm/s².

        It is the change of the commanded velocity: at the corner between two moves the velocity may jump.
        """
        edges_s = np.asarray((np.arange(first, first + numbers + 1) - 0.5) / rate_hz, dtype=np.float64)
        return np.asarray(np.diff(self._velocity(edges_s), axis=1) * rate_hz)

    def forget(self, time_s: float) -> None:
        """Drop the moves that ended before this print time."""
        self._moves = self._moves[self._moves[:, 0] + self._moves[:, 1] >= time_s]

    def _velocity(self, time_s: Floats) -> Floats:
        moves = self._moves
        if not len(moves):
            return np.zeros((_AXES, time_s.size))
        at = np.searchsorted(moves[:, 0], time_s, side="right") - 1
        move = moves[np.maximum(at, 0)]
        since_s = time_s - move[:, 0]
        moving = (at >= 0) & (since_s < move[:, 1])
        speed = np.where(moving, move[:, 2] + move[:, 3] * since_s, 0.0)
        return (speed[:, None] * move[:, 4:]).T


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
