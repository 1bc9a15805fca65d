"""How long to wait before the next attempt."""

from __future__ import annotations

import random

FIRST_S = 0.1
LONGEST_S = 30.0


class Pauses:
    """Pauses that double from 0.1 s to 30 s, each shortened by up to half at random, to spread out many clients.

    >>> pauses = Pauses()
    >>> all(0.05 * 2**k <= pauses.next_s() <= 0.1 * 2**k for k in range(8))
    True
    """

    def __init__(self) -> None:
        self._pause_s = FIRST_S

    def next_s(self) -> float:
        pause = self._pause_s
        self._pause_s = min(LONGEST_S, 2 * pause)
        return pause * random.uniform(0.5, 1.0)

    def reset(self) -> None:
        """Samples arrived: the next pause is short again."""
        self._pause_s = FIRST_S
