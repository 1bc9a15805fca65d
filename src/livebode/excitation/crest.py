"""Peak, rms and crest factor of one period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def peak_and_rms(period: NDArray[np.float64]) -> tuple[float, float]:
    """Largest magnitude and rms of the AC part of one period, shape (samples,); their quotient is the crest factor.

    The offset is ignored: it neither excites nor can be separated from that of the sensor. Between samples the signal
    may have higher peaks (negligible for lines far below the Nyquist frequency).

    >>> peak_and_rms(np.array([4.0, 2.0, 4.0, 2.0]))
    (1.0, 1.0)
    """
    ac = period - period.mean()
    return float(np.max(np.abs(ac))), float(np.sqrt(np.mean(ac**2)))
