"""Recent: the newest responses in bounded memory, not denser than a person can see."""

from __future__ import annotations

import numpy as np

from livebode.core import Responses

ROWS_MAX = 2400
EVERY_S = 0.05
"""At most one response is kept in so many seconds of the machine: 2,400 are two minutes."""
_VALUES_MAX = 1 << 21
_PARTS_MAX = 64


class Recent:
    """The newest responses of a stream, one for each `EVERY_S` of the machine's time."""

    def __init__(self) -> None:
        self.count = 0
        self._parts: list[Responses] = []
        self._kept = 0
        self._slot: int | None = None

    def add(self, responses: Responses) -> None:
        """Take in what follows; of each slot of time the first response stays."""
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
        if len(self._parts) > _PARTS_MAX or self._kept > 2 * self._most(responses):
            # The rows of a part take a third of what its arrays do when it has one row. Joined again, they are a copy.
            self._parts = [Responses.join([Responses.join(self._parts)[-self._most(responses) :]])]
            self._kept = len(self._parts[0])

    def newest(self, rows: int) -> Responses | None:
        """The last so many, or all that there are."""
        if not self._parts or rows <= 0:
            return None
        at = len(self._parts)
        found = 0
        while at and found < rows:
            at -= 1
            found += len(self._parts[at])
        first = self._parts[at][-(rows - found + len(self._parts[at])) :]
        return Responses.join([first, *self._parts[at + 1 :]])

    def all(self) -> Responses | None:
        """What is kept."""
        return self.newest(self._most(self._parts[-1])) if self._parts else None

    def _most(self, responses: Responses) -> int:
        return max(64, min(ROWS_MAX, _VALUES_MAX // max(1, len(responses.lines))))
