"""An excitation in the steps of a drive."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import DesignError, UsageError


def quantised(period: Floats, step: float) -> Floats:
    """Multiples of `step` next to each sample, shape of `period`; still periodic, with the rounding's own small lines.

    They are the nearest ones, except a few that are rounded to the other side to preserve the mean, to half a step over
    the whole period: a loop responds to a mean caused by rounding with a motion far larger than that of the lines.

    Raises
    ------
    LivebodeError
        If the step is not positive, or so coarse that only zero remains: the message has the smallest peak that would
        remain, and the largest step for this one.

    Examples
    --------
    >>> quantised(np.array([0.26, -0.11, 0.04]), 0.1)
    array([ 0.3, -0.1,  0. ])
    """
    if not (np.isfinite(step) and step > 0):
        raise UsageError(
            "out-of-range",
            f"the resolution {step:g} is not a finite number above 0",
            "specify the drive's step",
            argument="step",
            value=step,
        )
    counts = np.rint(period / step)
    if np.any(period) and not np.any(counts):
        peak = float(np.max(np.abs(period)))
        raise DesignError(
            "rounded-away",
            f"an excitation with a peak of {peak:g} vanishes in steps of {step:g}",
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
