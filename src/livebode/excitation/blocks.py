"""A recording cut into its periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.excitation._medians import medians
from livebode.kernel import PeriodDrift, period_levels, straight_periods


def cut(x: Floats, period: int) -> Floats:
    """Whole periods without their drift, shape (periods, period), unit of `x`.

    The drift is the piecewise linear curve through the levels of the periods, so an offset and a constant slope of any
    size vanish, and periodic components are unchanged. A period's level is the median of its difference to the median
    period: a spike affects neither. Biased where the drift bends within a period: the rest of the bend appears as
    noise, mostly in the lowest bins.
    """
    count = x.size // period
    blocks = x[: count * period].reshape(count, period)
    typical = medians(blocks, axis=0)
    level = period_levels(blocks, typical)
    return straight_periods(blocks, PeriodDrift(*places(period), level, *slopes(level), float(typical.mean())))


def places(period: int) -> tuple[Floats, int]:
    """Position of each sample about the middle of its period, in periods, and the number of the first one behind it."""
    position = (np.arange(period) + 0.5) / period - 0.5
    return position, int(np.searchsorted(position, 0.0))


def slopes(level: Floats) -> tuple[Floats, Floats]:
    """Slopes of the drift through these levels of periods, before the middle of each period and behind it."""
    behind = np.zeros(level.size)
    if level.size > 1:
        behind[:-1] = level[1:] - level[:-1]
        behind[-1] = behind[-2]
    return np.concatenate((behind[:1], behind[:-1])), behind


def spectra(blocks: Floats, bins: slice | NDArray[np.bool_] = slice(None)) -> Complex:
    """Spectra of the periods, shape (periods, bins 0 … below N/2), scaled so that |X_k| is a line's amplitude.

    Only some of the `bins` if they are given.
    """
    period = blocks.shape[1]
    return np.asarray(np.fft.rfft(blocks, axis=1)[:, : (period + 1) // 2][:, bins] * (2 / period))


def grouped(periods: Complex, most: int = 16) -> Complex:
    """Means of neighbouring periods, shape (≤ most, bins), which noise longer than a period no longer correlates."""
    count = min(len(periods), most)
    edges = np.linspace(0, len(periods), count + 1).astype(int)
    return np.asarray(np.add.reduceat(periods, edges[:-1], axis=0) / np.diff(edges)[:, np.newaxis])
