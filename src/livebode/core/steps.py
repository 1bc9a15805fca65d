"""Steps of a signal, of its sensor, converter or number of decimals, from the samples themselves."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats

_LEVELS_MAX = 2.0**23  # between the smallest and the largest value
_SINGLE, _DOUBLE = 2.0**-24, 2.0**-50  # relative errors of a value, with room for a few operations in double precision
_WHOLE = 0.02  # of a step: largest distance of a value from the grid
_CANCELLED = 1e-5  # of a step: its own error, from the difference of larger ones
_DIVISIONS_MAX = 64  # each at least halves the step, so that this number is never reached


def step_of(samples: Floats) -> float:
    """Largest step of which all differences between the samples are multiples; 0 where there is none.

    Euclid's algorithm on the differences between neighbouring values; their rounding is tolerated. No step is found
    below 2^-23 of the range, in a few values that are hundreds of steps apart, nor in values of single precision that
    were computed with afterwards.

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
    with np.errstate(over="ignore", under="ignore"):
        single = bool(np.all(values.astype(np.float32) == values))
    error = (_SINGLE if single else _DOUBLE) * float(np.max(np.abs(values)))
    differences = np.diff(values)
    differences = differences[differences > 4 * error]
    least = max(float(np.ptp(values)) / _LEVELS_MAX, 8 * error)
    step = float(differences.min(initial=np.inf))
    for _ in range(_DIVISIONS_MAX):
        if not least <= step < np.inf:
            return 0.0
        multiples = np.rint(differences / step)
        remainder = np.abs(differences - step * multiples)
        remainder = remainder[remainder > 4 * error * (1 + multiples) + _CANCELLED * step]
        if not remainder.size:
            return _refined(values, step)
        step = float(remainder.min())
    return 0.0


def _refined(values: Floats, step: float) -> float:
    # Over the whole range, the error of a single difference would add up.
    above = values - values[0]
    multiples = np.rint(above / step)
    step = float(above[-1] / multiples[-1])
    return step if np.all(np.abs(above - step * multiples) <= _WHOLE * step) else 0.0
