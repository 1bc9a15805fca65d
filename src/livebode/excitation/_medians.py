"""The median of many short series, by sorting.

NumPy's median partitions around up to three elements, for which it has no vector instructions; it sorts with them. The
median of 64 periods takes an eighth of the time.
"""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats


def medians(x: Floats, axis: int) -> Floats:
    """`np.median(x, axis)` of a non-empty two-dimensional array, to the bit: NaN where a value is NaN."""
    ordered = np.sort(np.ascontiguousarray(x.T) if axis == 0 else x, axis=1)
    middle = ordered.shape[1] // 2
    median = ordered[:, middle]
    if not ordered.shape[1] % 2:
        median = (ordered[:, middle - 1] + median) / 2
    return np.where(np.isnan(ordered[:, -1]), np.nan, median)
