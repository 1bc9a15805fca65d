"""The newest rows of numbers, up to so many; one more does not copy the others."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats

_FIRST = 16


class NewestRows:
    """Rows of equal length, of which at most `most` are retained.

    Examples
    --------
    >>> rows = NewestRows(columns=1, most=2)
    >>> for number in range(3):
    ...     rows.append(np.array([float(number)]))
    >>> rows.array
    array([[1.],
           [2.]])
    """

    def __init__(self, columns: int, most: int) -> None:
        self._most = most
        self._memory, self._begin, self._end = np.empty((_FIRST, columns)), 0, 0

    @property
    def array(self) -> Floats:
        """The rows, (rows, columns); valid until the next change."""
        return self._memory[self._begin : self._end]

    def append(self, row: Floats | tuple[float, ...]) -> None:
        """Add a row; the oldest one may be dropped."""
        if self._end == len(self._memory):
            self.fill(self.array)
        self._memory[self._end] = row
        self._end += 1
        self._begin = max(self._begin, self._end - self._most)

    def fill(self, rows: Floats) -> None:
        """Replace all rows by these, (rows, columns), with room for some more."""
        memory = np.empty((len(rows) + max(_FIRST, len(rows) // 4), self._memory.shape[1]))
        memory[: len(rows)] = rows
        self._memory, self._begin, self._end = memory, 0, len(rows)

    def clear(self) -> None:
        """Drop all rows."""
        self._begin = self._end = 0
