"""Lengths at which an FFT is fast."""

from __future__ import annotations


def fast_length(least: int) -> int:
    """The smallest product of powers of 2, 3 and 5 that is not below `least`.

    >>> [fast_length(n) for n in (1, 7, 121, 4097)]
    [1, 8, 125, 4320]
    """
    best = 1 << (least - 1).bit_length()
    fives = 1
    while fives < best:
        odd = fives
        while odd < best:
            best = min(best, odd << (-(-least // odd) - 1).bit_length())
            odd *= 3
        fives *= 5
    return best
