"""The slow part of a signal that repeats: what drifts between its periods."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats

_STRAIGHT = 3  # periods below which a signal is too short to see a drift bend
_WANDERS = 4  # periods from which on what does not repeat is told from what does
LOWEST_LINES = 3, 8
"""Lowest lines below which, and from which on, the filter of what does not repeat is none, or the same."""
_BETA = 5.65  # of a Kaiser window: −60 dB
_CUTOFF, _REACH = 0.7, 3.0  # of the lowest line; its periods on each side: from 0.4 of it to it the gain falls


def slow_part(x: Floats, period: int, lowest: int = 1) -> Floats:
    """The trend of a signal whose samples are all known, shape of `x`.

    First its moving mean over a period m, centred, and that of the rest x − m. A periodic component has no part in
    either; an offset, a ramp and a parabola of any size vanish, and of a slow wander of f per period the share that
    remains is less than (πf)⁴/36. White noise of a window grows by 13 % of its power at line 2 and by less than 3 % at
    the others, that of a mean by the ends of a signal alone. At both ends, for half a period, the moving mean continues
    as a parabola; as a straight line in a signal of less than three periods. Less than one and a half show no drift,
    and the result is 0.

    Then, where the lowest line permits it, what does not repeat below 0.4 of it: by a low-pass filter of the rest less
    its mean period, whose gain at the line is 10⁻³. So the mean of what repeats has no part in this either, and of its
    changes a thousandth.

    Parameters
    ----------
    x
        Samples, all finite.
    period
        Samples of a period.
    lowest
        Bin of the lowest line: from 3 on, and in four periods or more, a wander that is faster than a period is part of
        the trend.

    Examples
    --------
    >>> t = np.arange(500) / 100
    >>> periodic = np.sin(2 * np.pi * 3 * t)
    >>> float(np.abs(np.diff(periodic + 5 * t**2 - slow_part(periodic + 5 * t**2, 100) - periodic)).max()) < 1e-12
    True
    """
    if 2 * x.size < _STRAIGHT * period:
        return np.zeros(x.size)
    trend = _moving_mean(x, period)
    trend += _moving_mean(x - trend, period)
    least, most = LOWEST_LINES
    if lowest >= least and x.size >= _WANDERS * period:
        trend += _wander(x - trend, period, min(lowest, most))
    return trend


def _wander(x: Floats, period: int, lowest: int) -> Floats:
    """What does not repeat, below the lowest line."""
    count = x.size // period
    rest = x - np.resize(x[: count * period].reshape(count, period).mean(axis=0), x.size)
    reach = int(np.ceil(_REACH * period / lowest))
    kernel = np.sinc(2 * _CUTOFF * lowest / period * np.arange(-reach, reach + 1)) * np.kaiser(2 * reach + 1, _BETA)
    extended = np.concatenate([_reflected(rest[: reach + 1])[::-1], rest, _reflected(rest[: -reach - 2 : -1])])
    size = 1 << int(np.ceil(np.log2(extended.size + kernel.size)))
    filtered = np.fft.irfft(np.fft.rfft(extended, size) * np.fft.rfft(kernel / kernel.sum(), size), size)
    return np.asarray(filtered[2 * reach : 2 * reach + x.size])


def _reflected(x: Floats) -> Floats:
    """The samples before the first one, the nearest first: odd about the straight line's value there."""
    n = np.arange(x.size)
    slope = ((n - n.mean()) @ x) / ((n - n.mean()) @ n)
    return np.asarray(2 * (x.mean() - slope * n.mean()) - x[1:])


def _moving_mean(x: Floats, period: int) -> Floats:
    """The mean over the period around each sample; for an even one the mean of the two."""
    offset = x.mean()
    sums = np.concatenate([[0.0], np.cumsum(x - offset)])
    mean = (sums[period:] - sums[:-period]) / period + offset
    if period % 2 == 0:
        mean = (mean[1:] + mean[:-1]) / 2
    before, behind = period // 2, x.size - mean.size - period // 2
    straight = x.size < _STRAIGHT * period
    return np.concatenate([_continued(mean, before, straight)[::-1], mean, _continued(mean[::-1], behind, straight)])


def _continued(mean: Floats, samples: int, straight: bool) -> Floats:
    """Samples before the first one, the nearest first, of the parabola or straight line through its beginning."""
    step = mean.size - 1 if straight else min(samples, (mean.size - 1) // 2)
    if step < 1:
        return np.full(samples, mean[0])
    t = -np.arange(1, samples + 1) / step
    if straight:
        return np.asarray(mean[0] + (mean[step] - mean[0]) * t)
    return np.asarray(mean[0] * (t - 1) * (t - 2) / 2 - mean[step] * t * (t - 2) + mean[2 * step] * t * (t - 1) / 2)
