"""The median of many series."""

from __future__ import annotations

from livebode.arrays import Floats
from livebode.kernel import PERIODS_MAX, period_levels, typical_period


def medians(x: Floats, axis: int) -> Floats:
    """`np.median(x, axis)` of a non-empty two-dimensional array, to the bit: NaN where a value is NaN."""
    if axis == 0 and len(x) <= PERIODS_MAX:
        return typical_period(x)
    return period_levels(x.T if axis == 0 else x)
