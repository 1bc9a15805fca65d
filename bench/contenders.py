"""Alternatives to livebode: each computes the spectra of sliding windows at chosen bins.

A contender gets the samples, the window, the bins and the hop, and returns a function without arguments. The timed
function computes the spectra of x[r·hop : r·hop + window] for all complete windows r, shape (rows, bins).
"""

from collections.abc import Callable

import fastgoertzel
import numpy as np
import scipy.fft
import sdft
from scipy.signal import ShortTimeFFT

from bench.work import Array

Task = Callable[[], Array]


def by_fastgoertzel(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """Its complex sliding form, one thread, into a reused buffer."""
    frequencies = np.array(bins) / window
    out = np.empty(((len(x) - window) // hop + 1, len(bins)), complex)

    def task() -> Array:
        fastgoertzel.goertzel_sliding_batch_complex(x, window, frequencies, step=hop, threads=1, out=out)
        return out

    return task


def by_sdft(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """It always computes all bins below N/2, at every sample."""
    kept = [k for k in bins if k < window // 2]

    def task() -> Array:
        rows: Array = sdft.SDFT(window // 2, window="boxcar").sdft(x) * window
        return rows[window - 1 :: hop, kept]

    return task


def by_cumsum(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """The modulated recursion as one NumPy cumulative sum; twiddle factors are precomputed."""
    turns = np.outer(np.arange(len(x) + 1), bins) % window / window
    twiddles = np.exp(-2j * np.pi * turns)
    newest = np.arange(window - 1, len(x), hop)
    back = twiddles[newest + 1].conj()

    def task() -> Array:
        delta = x.copy()
        delta[window:] -= x[:-window]
        return np.cumsum(delta[:, None] * twiddles[:-1], axis=0)[newest] * back

    return task


def by_stft(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """SciPy's ShortTimeFFT with a rectangular window; only complete windows, each slice from its oldest sample."""
    transform = ShortTimeFFT(np.ones(window), hop, 1.0, phase_shift=None)
    rows = (len(x) - window) // hop + 1

    def task() -> Array:
        spectra: Array = transform.stft(x, p0=0, p1=rows, k_offset=transform.m_num_mid)
        return spectra[bins].T

    return task


def by_rfft(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """scipy.fft.rfft of strided views, in parts that fit into the cache."""
    windows = np.lib.stride_tricks.sliding_window_view(x, window)[::hop]
    out = np.empty((len(windows), len(bins)), complex)

    def task() -> Array:
        for start in range(0, len(windows), 256):
            out[start : start + 256] = scipy.fft.rfft(windows[start : start + 256], axis=1)[:, bins]
        return out

    return task
