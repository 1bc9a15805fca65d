"""Difference of a recording from itself one lag later, for every lag."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import fast_length

# The rounding of an FFT autocorrelation, with room; a line 60 dB below the rest is still 1e-6.
ROUNDING = 1e-10
LAG_MIN = 3  # samples: the shortest period with a line below the Nyquist frequency


def difference(x: Floats) -> Floats:
    """var(x(n) − x(n − l)) / (var x(n) + var x(n − l)) over the samples that overlap, shape (samples,), by lag l.

    0 where the recording repeats exactly, noise/(noise + signal) where it repeats with noise, 1 where it is
    uncorrelated. Variances about their means, so that an offset and a constant slope have no effect. From the
    autocorrelation by FFT (Wiener–Khinchin) and running sums: O(n log n), and without the bias of an autocorrelation
    that divides by the full length. Cf. de Cheveigné, Kawahara 2002 (YIN), eq. (7).
    """
    size = fast_length(2 * x.size)
    spectrum = np.fft.rfft(x, size)
    product = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[: x.size]
    del spectrum
    head, tail = _running(x)
    head2, tail2 = _running(x * x)
    overlap = np.arange(x.size, 0, -1)
    both = head2 + tail2 - (head**2 + tail**2) / overlap
    unlike = both - 2 * (product - head * tail / overlap)
    # Where a part is constant its variance is rounding, without information.
    clear = both > ROUNDING * max(float(both[0]), 0.0)
    return np.where(clear, unlike / np.where(clear, both, 1.0), 1.0)


def _running(x: Floats) -> tuple[Floats, Floats]:
    """Sums of the first n − l and of the last n − l samples, by l."""
    sums = np.concatenate(([0.0], np.cumsum(x)))
    return sums[:0:-1], sums[-1] - sums[:-1]


def best_lag(d: Floats, lag_max: int) -> tuple[int, int]:
    """The shortest lag that repeats as well as any up to `lag_max`, and the width of its valley in samples.

    Lags before the first dissimilarity (halfway from best to worst) are ignored: every slow signal is similar to itself
    a few samples later. Two lags repeat equally well where their differences are
    within what noise does to such a sum: a relative standard deviation of √(2/n) each (χ² with n samples), taken three
    times. Where the signal is smooth, a whole stretch of lags does; its deepest point is the candidate.
    """
    lags = d[: lag_max + 1]
    halfway = (float(lags[1:].max()) + float(lags[1:].min())) / 2
    first = max(LAG_MIN, int(np.argmax(lags >= halfway)))
    lags = lags[first:]
    best = float(lags.min())
    limit = max(best, 0.0) * (1 + 3 * 2 * np.sqrt(2 / (d.size - lag_max))) + ROUNDING
    good = lags <= max(limit, best)
    start = int(np.argmax(good))
    ends = np.flatnonzero(~good[start:])
    width = int(ends[0]) if ends.size else lags.size - start
    return first + start + int(np.argmin(lags[start : start + width])), width
