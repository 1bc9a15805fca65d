"""The design of an excitation by the pattern of its bins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise


def pattern(bins: Sequence[int]) -> str:
    """Name of a design, with its bins as `lines.frequencies` accepts them, where they are regular.

    Odd bins let even distortion appear between the lines; every fourth bin from 1 on (odd-odd) also odd distortion.
    Cf. Pintelon, Schoukens 2012, section 4.3.

    Parameters
    ----------
    bins
        Excited bins of one period, ascending.

    Examples
    --------
    >>> pattern((1, 2, 3, 4)), pattern(range(1, 250, 4)), pattern((1, 3, 7, 9, 13))
    ('every bin, k=1:4', 'odd-odd, k=1:249:4', 'odd with detection lines, 5 of 7 odd bins')
    >>> pattern((5,)), pattern((1, 5, 6))
    ('one line, k=5', '3 of 6 bins')
    """
    first, last = bins[0], bins[-1]
    if len(bins) == 1:
        return f"one line, k={first}"
    steps = {after - before for before, after in pairwise(bins)}
    odd = all(k % 2 for k in bins)
    if len(steps) > 1:
        if odd:
            return f"odd with detection lines, {len(bins)} of {(last - first) // 2 + 1} odd bins"
        return f"{len(bins)} of {last - first + 1} bins"
    (step,) = steps
    name = {1: "every bin", 2: "odd" if odd else "even", 4: "odd-odd" if odd else ""}.get(step, "")
    return f"{name or f'every {step} bins'}, k={first}:{last}" + (f":{step}" if step > 1 else "")
