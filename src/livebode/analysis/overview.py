"""A run in few rows, for pictures, in bounded memory."""

from __future__ import annotations

import threading
from math import inf

from livebode.core import Responses

ROWS_MAX = 2048
LIVE_VALUES_MAX = 1 << 13
"""Responses × lines of a live run, about 0.5 MB: a process may have many axes."""
_ROWS_MIN = 256
_PARTS_MAX = 16  # a one-row part takes three times the memory of its data


class Overview:
    """Every n-th response, evenly over the run; n is doubled whenever there are too many.

    It contains at most 2,048 rows in at most 16 parts, for any size of batches. The tracking thread adds rows; any
    other thread may read at the same time.

    Parameters
    ----------
    values_max
        Largest number of values (responses × lines), but at least 256 responses are permitted. Default: no limit.
    """

    def __init__(self, values_max: float = inf) -> None:
        self._values_max = values_max
        self._parts: list[Responses] = []
        self._stride = 1
        self._seen = 0
        self._rows = 0
        self._lock = threading.Lock()

    def add(self, responses: Responses) -> None:
        with self._lock:
            self._add(responses)

    def responses(self) -> Responses:
        """The rows, oldest first."""
        with self._lock:
            return Responses.join(self._parts)

    def _add(self, responses: Responses) -> None:
        first = -self._seen % self._stride
        self._seen += len(responses)
        if self._parts and first >= len(responses):
            return  # nearly always, in a long run; one empty part is enough to name the lines
        self._append(responses[first :: self._stride])
        most = min(ROWS_MAX, max(_ROWS_MIN, self._values_max / len(responses.lines)))
        while self._rows > most:
            thinned = Responses.join(self._parts)[::2]
            self._parts, self._rows = [], 0
            self._append(thinned)
            self._stride *= 2

    def _append(self, responses: Responses) -> None:
        # Joining copies: a view would keep the omitted rows in memory.
        self._parts.append(Responses.join([responses]))
        self._rows += len(responses)
        if len(self._parts) > _PARTS_MAX:
            self._parts = [Responses.join(self._parts)]
