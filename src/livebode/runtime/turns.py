"""Turn: at most one axis of a process computes at a time, in the order in which they asked.

Python runs one thread at a time, and another one takes over wherever a function in C lets go of the interpreter: many
times in a Block. Axes that compute at once are therefore all late. In turns each one is interrupted by the receiver
alone, and the batches that arrive while it waits are one Block. An ordinary lock gives the turn to any of those that
wait, so that some are late several times in a row. `python -m bench.hall` measures it.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Self

TURN_S_MAX = 1.0
"""Longest turn that others wait for: an axis that does not return, as on a network drive, delays them but does not stop
them."""


class Turn:
    """The turn of one axis to compute. Used as a context manager around all of its turns, the last of which it ends."""

    def __init__(self) -> None:
        self._given = threading.Lock()
        self._given.acquire()

    def begin(self) -> None:
        """Wait for the turn, unless it has begun."""
        if _line.asks(self):
            while not self._given.acquire(timeout=TURN_S_MAX):
                _line.pass_over()

    def end(self) -> None:
        """Leave the turn to the axis that has waited longest."""
        _line.leaves(self)

    def give(self) -> None:
        """Let `begin` return."""
        self._given.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


class _Line:
    """Who has the turn, and who waits for it."""

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._now: Turn | None = None
        self._since_s = 0.0
        self.waiting: deque[Turn] = deque()

    def asks(self, turn: Turn) -> bool:
        """Whether it has to wait; `give` is then called when it has the turn."""
        with self._changing:
            if self._now is turn:
                return False
            if self._now is not None:
                self.waiting.append(turn)
                return True
            self._now, self._since_s = turn, time.monotonic()
            return False

    def leaves(self, turn: Turn) -> None:
        """No effect if it does not have the turn, or has lost it."""
        with self._changing:
            if self._now is turn:
                self._next()

    def pass_over(self) -> None:
        """The next one has the turn if the present one had it for too long; that continues without it."""
        with self._changing:
            if time.monotonic() - self._since_s >= TURN_S_MAX:
                self._next()

    def _next(self) -> None:
        self._now, self._since_s = (self.waiting.popleft() if self.waiting else None), time.monotonic()
        if self._now is not None:
            self._now.give()


_line = _Line()


def waiting() -> int:
    """How many axes wait for their turn."""
    return len(_line.waiting)
