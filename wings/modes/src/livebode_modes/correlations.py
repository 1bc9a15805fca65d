"""Correlations of the outputs over one hop, from which the Hankel matrix of a window is built."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used


def hop_correlations(y: Floats, hop: int, lags: int) -> Floats:
    """Correlations R(i) = mean of y(t + i)·y(t)ᵀ over the `hop` samples t, for the lags i = 0 … `lags`.

    The products reach over the end of the hop, so that no lag has fewer of them than another: the mean is unbiased.

    Parameters
    ----------
    y
        Shape (outputs, hop + lags).

    Returns
    -------
    Floats
        Shape (lags + 1, outputs, outputs); NaN where a sample is not finite.

    Examples
    --------
    >>> y = np.array([[1.0, 2.0, 3.0, 4.0]])
    >>> hop_correlations(y, hop=2, lags=2)[:, 0, 0].round(6).tolist()
    [2.5, 4.0, 5.5]
    """
    size = scipy.fft.next_fast_len(hop + lags, real=True)
    ahead, here = scipy.fft.rfft(y, size), scipy.fft.rfft(y[:, :hop], size)
    spectra = ahead[:, np.newaxis] * here[np.newaxis].conj()
    return np.asarray(np.moveaxis(scipy.fft.irfft(spectra, size)[..., : lags + 1], 2, 0) / hop)


def hankel(correlations: Floats, rows: int) -> Floats:
    """Block Hankel matrix of R(1), R(2), … with so many block rows and columns.

    Parameters
    ----------
    correlations
        Shape (…, lags + 1, outputs, outputs), with lags of at least 2·rows − 1.

    Returns
    -------
    Floats
        Shape (…, rows·outputs, rows·outputs).
    """
    outputs = correlations.shape[-1]
    lags = 1 + np.add.outer(np.arange(rows), np.arange(rows))
    blocks = np.moveaxis(correlations[..., lags, :, :], -2, -3)  # (…, rows, outputs, rows, outputs)
    return np.asarray(blocks.reshape(*correlations.shape[:-3], rows * outputs, rows * outputs))
