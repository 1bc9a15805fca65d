"""An excitation in the steps of a drive."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import DesignError, UsageError

Floats = NDArray[np.float64]


def quantised(period: Floats, step: float) -> Floats:
    """Multiples of `step` next to each sample, shape of `period`; still periodic, with the rounding's own small lines.

    They are the nearest but for the few that go to the other side so that the mean stays, to half a step over the whole
    period: a loop answers a mean that rounding made with a motion far larger than that of the lines.

    Raises
    ------
    LivebodeError
        If the step is not positive, or so coarse that nothing but zero is left: the sentence has the smallest peak
        that would be left, and the largest step that would leave this one.

    Examples
    --------
    >>> quantised(np.array([0.26, -0.11, 0.04]), 0.1)
    array([ 0.3, -0.1,  0. ])
    """
    if not (np.isfinite(step) and step > 0):
        raise UsageError(
            "out-of-range",
            f"the resolution {step:g} is not a finite number above 0",
            "give the drive's step",
            argument="step",
            value=step,
        )
    counts = np.rint(period / step)
    if np.any(period) and not np.any(counts):
        peak = float(np.max(np.abs(period)))
        raise DesignError(
            "rounded-away",
            f"an excitation with a peak of {peak:g} is nothing in steps of {step:g}",
            f"raise its peak above {step / 2:g}, or take steps below {2 * peak:g}",
            peak=peak,
            step=step,
            step_max=2 * peak,
        )
    beyond = counts - period / step
    excess = round(float(np.sum(beyond)))
    moved = np.argsort(-np.sign(excess) * beyond, kind="stable")[: abs(excess)]
    level = counts.copy()
    level[moved] -= np.sign(excess)
    return np.asarray((level if np.any(level) else counts) * step + 0.0)
