"""Recent: the newest responses in bounded memory, no denser than a person can see."""

from __future__ import annotations

import numpy as np

from livebode.core import Responses

ROWS_MAX = 2400
EVERY_S = 0.05
"""At most one response is retained per interval of this many seconds: 2,400 are two minutes."""
_VALUES_MAX = 1 << 21
RECORDED_VALUES_MAX = 1 << 13
"""Responses × lines of a run with a journal, about 0.5 MB: older ones are in the record, and there may be many axes."""
_PARTS_MAX = 16
_SLACK = 1.25


class RecentResponses:
    """The newest responses of a stream, one per `EVERY_S` of the machine's time.

    Parameters
    ----------
    values_max
        Largest number of values (responses × lines), but at least 64 responses are permitted.
    """

    def __init__(self, values_max: int = _VALUES_MAX) -> None:
        self._values_max = values_max
        self.count = 0
        self._parts: list[Responses] = []
        self._kept = 0
        self._slot: int | None = None

    def add(self, responses: Responses) -> None:
        """Add responses; the first of each interval is retained."""
        time_s = np.where(np.isfinite(responses.time_s), responses.time_s, 0.0)
        slot = np.floor(time_s / EVERY_S).astype(np.int64)
        first = np.ones(len(slot), dtype=bool)
        first[1:] = slot[1:] != slot[:-1]
        if len(slot) and slot[0] == self._slot:
            first &= slot != self._slot
        if not first.any():
            return
        self._slot = int(slot[-1])
        kept = responses[np.flatnonzero(first)[-self._most(responses) :]]
        self._parts.append(kept)
        self._kept += len(kept)
        self.count += len(kept)
        if len(self._parts) > _PARTS_MAX or self._kept > _SLACK * self._most(responses):
            # A one-row part takes three times the memory of its data, for its array objects. Joined rows are a copy.
            self._parts = [Responses.join(self._without_oldest(self._kept - self._most(responses)))]
            self._kept = len(self._parts[0])

    def newest(self, rows: int) -> Responses | None:
        """The last rows, up to this number."""
        if not self._parts or rows <= 0:
            return None
        at = len(self._parts)
        found = 0
        while at and found < rows:
            at -= 1
            found += len(self._parts[at])
        first = self._parts[at][-(rows - found + len(self._parts[at])) :]
        return Responses.join([first, *self._parts[at + 1 :]])

    def _without_oldest(self, rows: int) -> list[Responses]:
        first, *others = self._parts
        while others and rows >= len(first):
            rows, (first, *others) = rows - len(first), others
        return [first[max(0, rows) :], *others]

    def all(self) -> Responses | None:
        """All retained responses."""
        return self.newest(self._most(self._parts[-1])) if self._parts else None

    def _most(self, responses: Responses) -> int:
        return max(64, min(ROWS_MAX, self._values_max // max(1, len(responses.lines))))
