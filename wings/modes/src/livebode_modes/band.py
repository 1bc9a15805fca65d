"""The band in which modes are looked for, from the power of the outputs."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing
from livebode_modes.settings import OVERSAMPLING

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used


_POWER = 0.99
_MARGIN = 1.25
_SEGMENT = 1 << 12


def proposed_band(y: Floats, rate_hz: float) -> tuple[float, float]:
    """The band from a fortieth of its upper limit to 1.25 times the frequency below which 99 % of the power is.

    The power is that above the noise floor, the median of the spectrum, of each output relative to its own.

    Parameters
    ----------
    y
        Outputs, (outputs, samples); samples that are not finite count as 0.
    """
    if y.shape[1] < 2:
        return rate_hz / OVERSAMPLING / 40, rate_hz / OVERSAMPLING
    y = y - np.nanmean(np.where(np.isfinite(y), y, np.nan), axis=1, keepdims=True)
    y = np.where(np.isfinite(y), y, 0.0)
    f, power = scipy.signal.welch(y, rate_hz, nperseg=min(_SEGMENT, y.shape[1]), axis=1)
    above = np.maximum(power[:, 1:] - np.median(power[:, 1:], axis=1, keepdims=True), 0.0)
    share = (above / np.maximum(above.sum(axis=1, keepdims=True), np.finfo(float).tiny)).mean(axis=0)
    reached = int(np.searchsorted(np.cumsum(share), _POWER * share.sum()))
    high_hz = min(_MARGIN * float(f[1:][min(reached, len(f) - 2)]), rate_hz / OVERSAMPLING)
    return high_hz / 40, high_hz
