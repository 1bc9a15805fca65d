"""FitBudget: limit of the processor time for the fits of a live run."""

from __future__ import annotations

import logging
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ClassVar

SHARE = 0.5
"""Share of one core for the fits of all axes of a process: Python runs one thread at a time, samples have priority."""
CREDIT_S_MAX = 2.0
"""Most processor time that a pause can accumulate."""
RELIEF_FROM_S, RELIEF_TO_S = 2.0, 8.0
"""Backlogs above which fits get less time, and no time."""
_FIRST_ROW_S = 0.02
_logger = logging.getLogger(__name__)


class FitBudget:
    """Processor time for fits: it accumulates with real time, and fits use it; axes of one process share it evenly.

    Parameters
    ----------
    clock, worked
        Real time, and the processor time of the calling thread, in seconds.
    """

    _open: ClassVar[weakref.WeakSet[FitBudget]] = weakref.WeakSet()

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, worked: Callable[[], float] = time.thread_time
    ) -> None:
        self._clock, self._worked = clock, worked
        self._credit_s, self._then = CREDIT_S_MAX, clock()
        self._row_s = _FIRST_ROW_S
        self._exceeded = False

    def rows(self, required: int, behind_s: float) -> int:
        """Number of the `required` responses that there is time to fit, at a backlog of `behind_s`."""
        FitBudget._open.add(self)
        now = self._clock()
        relief = (RELIEF_TO_S - behind_s) / (RELIEF_TO_S - RELIEF_FROM_S)
        share = SHARE * min(max(relief, 0.0), 1.0) / len(FitBudget._open)
        self._credit_s = min(CREDIT_S_MAX, self._credit_s + share * (now - self._then))
        self._then = now
        rows = min(required, self._affordable(share))
        if (rows < required) != self._exceeded:
            self._exceeded = not self._exceeded
            _logger.debug("fit budget %s (%.1f s behind)", "exceeded" if self._exceeded else "suffices", behind_s)
        return rows

    def _affordable(self, share: float) -> int:
        if share <= 0 or self._credit_s <= 0:
            return 0
        # With the largest possible saving one fit is allowed, however long it takes.
        least = int(self._credit_s >= CREDIT_S_MAX)
        return max(least, int(self._credit_s / self._row_s))

    @contextmanager
    def spending(self, rows: int) -> Iterator[None]:
        """Context in which that many responses are fitted."""
        before = self._worked()
        yield
        spent = self._worked() - before
        self._credit_s -= spent
        if rows:
            self._row_s += (spent / rows - self._row_s) / 4
