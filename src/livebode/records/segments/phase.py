"""Phase: records of one process commit and close their segments one after the other, not all at once."""

from __future__ import annotations

import threading

_taken: set[int] = set()
_taking = threading.Lock()


class Phase:
    """Part of an interval by which a record is ahead of the first one, until `release`.

    Attributes
    ----------
    part
        0 for a record that is alone; then ½, ¼, ¾, ⅛, …: as far from the others as their number permits.
    """

    def __init__(self) -> None:
        with _taking:
            self._number = next(number for number in range(len(_taken) + 1) if number not in _taken)
            _taken.add(self._number)
        self.part = _reversed(self._number)

    def release(self) -> None:
        """Another record may have it."""
        with _taking:
            _taken.discard(self._number)


def _reversed(number: int) -> float:
    """Bits of a number behind the binary point, the lowest first.

    >>> [_reversed(number) for number in range(6)]
    [0.0, 0.5, 0.25, 0.75, 0.125, 0.625]
    """
    part, weight = 0.0, 0.5
    while number:
        part += weight * (number & 1)
        number, weight = number >> 1, weight / 2
    return part
