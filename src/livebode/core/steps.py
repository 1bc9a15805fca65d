"""Steps of a signal, of its sensor, converter or number of decimals, from the samples themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SINGLE = 2.0**-24  # of the largest value: the rounding of single precision, whose own grid is not a step
_WHOLE = 0.02  # of a step: largest distance of a difference from a multiple of it
_DIVISIONS_MAX = 64


def step_of(samples: Floats) -> float:
    """Largest step of which all differences between the samples are multiples; 0 where there is none.

    Euclid's algorithm on the differences between neighbouring values, with the rounding of single precision as
    tolerance. No step is found below 2^-23 of the largest value.

    Parameters
    ----------
    samples
        Finite, shape (samples,).

    Examples
    --------
    >>> step_of(np.array([0.5, 0.5, 1.0, 2.5])), step_of(np.array([0.1, 0.2, 0.35, np.pi / 9]))
    (0.5, 0.0)
    >>> round(step_of(np.array([0.07, 0.11, 0.21])), 9)  # the smallest difference is two steps
    0.02
    """
    values = np.unique(samples)
    if values.size < 2:
        return 0.0
    tolerance = _SINGLE * float(np.max(np.abs(values)))
    differences = np.diff(values)
    differences = differences[differences > tolerance]
    if not differences.size:
        return 0.0
    step = float(differences.min())
    for _ in range(_DIVISIONS_MAX):
        rest = np.abs(differences - step * np.rint(differences / step))
        rest = rest[rest > _WHOLE * step + tolerance]
        if step <= 2 * tolerance:
            return 0.0
        if not rest.size:
            return _refined(values, step)
        step = float(rest.min())
    return 0.0


def _refined(values: Floats, step: float) -> float:
    # Over the whole range, the error of a single difference would add up.
    above = values - values[0]
    multiples = np.rint(above / step)
    step = float(above[-1] / multiples[-1])
    return (
        step
        if np.max(np.abs(above - step * multiples)) <= _WHOLE * step + 2 * _SINGLE * np.max(np.abs(values))
        else 0.0
    )
