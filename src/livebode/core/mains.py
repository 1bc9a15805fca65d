"""Harmonics of the mains, which repeat as an excitation does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

MAINS_HZ = (50.0, 60.0)
NEAR_BINS = 0.5
"""From a harmonic: farther away, at most 40 % of its power is in a window's bin."""


def meets_mains(
    bins: ArrayLike, resolution_hz: float, mains_hz: Sequence[float] = MAINS_HZ, near_bins: ArrayLike = NEAR_BINS
) -> NDArray[np.bool_]:
    """Which bins are within `near_bins` of a harmonic, shape (bins,); `near_bins` may be one for each.

    >>> meets_mains([3, 5, 6, 7], 10.0).tolist()
    [False, True, True, False]
    """
    f = np.asarray(bins) * resolution_hz
    reach_hz = np.asarray(near_bins) * resolution_hz * (1 - 1e-9)
    near = np.zeros(f.shape, dtype=np.bool_)
    for mains in mains_hz:
        harmonic = mains * np.maximum(np.round(f / mains), 1)
        near |= np.abs(f - harmonic) < reach_hz
    return near
