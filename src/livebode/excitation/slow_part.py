"""The slow part of a signal that repeats: what drifts between its periods."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats

_STRAIGHT = 3  # periods below which a signal is too short to see a drift bend


def slow_part(x: Floats, period: int) -> Floats:
    """The drift of a signal whose samples are all known, shape of `x`.

    Its moving mean over a period m, centred, and that of the rest x − m. A periodic component has no part in either, so
    that x less its drift has the same lines; an offset, a ramp and a parabola of any size vanish, and of a slow wander
    of f per period the share that remains is less than (πf)⁴/36. White noise of a window grows by 13 % of its power at
    line 2 and by less than 3 % at the others, that of a mean by the ends of a signal alone. At both ends, for half a
    period, the moving mean continues as a parabola; as a straight line in a signal of less than three periods. Less
    than one and a half show no drift, and the result is 0.

    Examples
    --------
    >>> t = np.arange(500) / 100
    >>> periodic = np.sin(2 * np.pi * 3 * t)
    >>> float(np.abs(np.diff(periodic + 5 * t**2 - slow_part(periodic + 5 * t**2, 100) - periodic)).max()) < 1e-12
    True
    """
    if 2 * x.size < _STRAIGHT * period:
        return np.zeros(x.size)
    first = _moving_mean(x, period)
    return first + _moving_mean(x - first, period)


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
