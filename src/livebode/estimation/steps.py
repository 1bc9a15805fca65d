"""Steps of a signal's sensor, from the samples themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_WHOLE = 1e-3  # of a step: largest deviation of a difference from a multiple of the step by rounding


def step_of(samples: Floats) -> float:
    """Smallest step of which all differences of neighbouring samples are multiples; 0 where there is none.

    >>> step_of(np.array([0.5, 0.5, 1.0, 2.5])), step_of(np.array([0.1, 0.2, 0.35, 0.3533]))
    (0.5, 0.0)
    """
    differences = np.abs(np.diff(samples))
    rounding = 1e-12 * float(np.max(np.abs(samples), initial=0.0))
    differences = differences[differences > rounding]
    if differences.size < 2:
        return 0.0
    step = float(differences.min())
    multiples = differences / step
    whole = np.rint(multiples)
    return step if np.all(np.abs(multiples - whole) < _WHOLE) else 0.0
