"""The instruction set of the kernel, and sizes of what it computes."""

from __future__ import annotations

import os
from typing import Final

import numpy as np

from livebode.arrays import Floats
from livebode.kernel import _native

INSTRUCTION_SET_VARIABLE: Final = "LIVEBODE_INSTRUCTION_SET"
# In the order of lb_instruction_set; 0 is "the best".
NAMES: Final = ("best", "baseline", "avx2", "avx512")


def chosen_instruction_set() -> int:
    """The number of the set that a new SlidingDFT or line stage uses: that of the environment, by default the best."""
    name = os.environ.get(INSTRUCTION_SET_VARIABLE, "best")
    if name not in NAMES:
        raise ValueError(f"{INSTRUCTION_SET_VARIABLE}={name!r} is not one of {', '.join(NAMES)}")
    return NAMES.index(name)


def instruction_set() -> str:
    """The instruction set that a new SlidingDFT uses on this machine.

    By default the widest that the machine has; the environment variable LIVEBODE_INSTRUCTION_SET names another. The
    results are the same to the bit with each.

    Returns
    -------
    str
        "baseline", "avx2" or "avx512".

    Raises
    ------
    ValueError
        The environment names an unknown instruction set.
    """
    return NAMES[chosen_instruction_set() or _native.best_instruction_set()]


def instruction_sets() -> tuple[str, ...]:
    """All instruction sets that this machine can run, narrowest first."""
    return NAMES[1 : _native.best_instruction_set() + 1]


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
    sizes = np.empty((signals, 1 + max(0, -((begun - count) // window))))
    if count > 1 and samples.strides[1] != samples.itemsize:
        samples = np.ascontiguousarray(samples)
    _native.largest_sizes(samples, begun, window, chosen_instruction_set(), sizes)
    return sizes
