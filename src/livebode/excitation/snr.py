"""Signal-to-noise ratio per line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def snr_db(periods: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of each line over the noise of one period, 10·log10(|mean Y|²/var Y) in dB, shape (lines,).

    Parameters
    ----------
    periods
        Spectra of the steady periods at the lines, shape (periods, lines).

    Notes
    -----
    The variance is that between periods, Σ|Y_m − Ȳ|²/(M − 1). The remaining noise of the mean biases the power
    upwards: a line without signal shows −10·log10(M) dB on average. NaN with one period; inf where nothing varies.
    """
    count = len(periods)
    if count < 2:
        return np.full(periods.shape[1], np.nan)
    mean = periods.mean(axis=0)
    variance = np.sum(np.abs(periods - mean) ** 2, axis=0) / (count - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(10 * np.log10(np.abs(mean) ** 2 / variance))
