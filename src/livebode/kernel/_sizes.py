"""The largest samples of stretches, in one pass."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.kernel import _instructions, _native


def largest_sizes(samples: Floats, begun: int, window: int) -> Floats:
    """The largest |x| of the first `begun` samples and of each `window` samples after them; NaN where one is NaN.

    Parameters
    ----------
    samples
        Shape (signals, samples).
    begun, window
        At least 1; the last stretch may be shorter.

    Returns
    -------
    ndarray
        Shape (signals, stretches); one stretch where there are no samples.

    Examples
    --------
    >>> largest_sizes(np.array([[1.0, -3.0, 2.0, 0.0, -0.5]]), 2, 2)
    array([[3. , 2. , 0.5]])
    """
    signals, count = samples.shape
    found = np.empty((signals, 1 + max(0, -((begun - count) // window))))
    if count > 1 and samples.strides[1] != samples.itemsize:
        samples = np.ascontiguousarray(samples)
    _native.largest_sizes(samples, begun, window, _instructions.chosen_instruction_set(), found)
    return found
