"""SettledDeliveries: which deliveries a sender that stores them may forget."""

from __future__ import annotations

import threading
from collections import deque


class SettledDeliveries:
    """The deliveries whose samples are recorded, or were dropped as repeated or invalid.

    One thread reads the source and another one may write its record.

    Attributes
    ----------
    delivery
        All up to this number.
    """

    def __init__(self) -> None:
        self.delivery = 0
        self._recorded = 0
        self._waiting: deque[tuple[int, int]] = deque()
        self._changing = threading.Lock()

    def read(self, delivery: int, sample: int) -> None:
        """No delivery up to this one has a sample from this one of the run on."""
        with self._changing:
            if self._waiting and self._waiting[-1][0] == sample:
                self._waiting.pop()
            self._waiting.append((sample, delivery))
            self._settle()

    def record(self, sample: int) -> None:
        """All samples of the run before this one are recorded."""
        with self._changing:
            self._recorded = max(sample, self._recorded)
            self._settle()

    def _settle(self) -> None:
        while self._waiting and self._waiting[0][0] <= self._recorded:
            self.delivery = max(self.delivery, self._waiting.popleft()[1])
