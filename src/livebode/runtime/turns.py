"""Turn: at most one axis of a process computes at a time.

Python runs one thread at a time, and another one takes over wherever a function in C lets go of the interpreter: many
times in a Block. Axes that compute at once are therefore all late. In turns each one is interrupted by the receiver
alone, and the batches that arrive while it waits are one Block. `python -m bench.hall` measures it.
"""

from __future__ import annotations

import threading
from typing import Self

WAIT_S_MAX = 1.0
"""Longest wait: an axis that does not return, as on a network drive, delays the others but does not stop them."""
FREE: threading.Lock | threading.Semaphore = threading.Lock()
"""Who has it computes."""


class Turn:
    """The turn of one axis to compute. Used as a context manager around all of its turns, the last of which it ends."""

    def __init__(self) -> None:
        self._begun = False

    def begin(self) -> None:
        """Wait for the turn, unless it has begun."""
        if not self._begun:
            self._begun = FREE.acquire(timeout=WAIT_S_MAX)

    def end(self) -> None:
        """Leave the turn to another axis."""
        if self._begun:
            self._begun = False
            FREE.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()
