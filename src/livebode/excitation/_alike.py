"""Periods of which certainly none differs from the others: a short way past `cut` and `unlike`."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.excitation._medians import medians
from livebode.excitation.blocks import places, slopes
from livebode.excitation.transient import FACTOR_MIN, ROUNDING
from livebode.kernel import period_levels, period_reach

# A hundredth for what is not computed to the bit here, and for the rounding of a spectrum.
_FACTOR = 0.99 * FACTOR_MIN
# Of the largest sample: noise at a line above it is not changed by the rounding of a spectrum.
_CLEAR = 1e-10


def alike(periods: Floats, lines: Callable[[], Complex], bins: tuple[int, ...]) -> bool:
    """Whether `unlike` certainly marks none of these periods after `cut`, because no distance is far from the usual.

    Parameters
    ----------
    periods
        Shape (periods, samples), with their drift.
    lines
        Returns their spectra at the excited bins, shape (periods, lines), scaled as by `spectra`.
    bins
        The excited bins, none of them 0.

    Notes
    -----
    The drift changes the largest difference of a sample by twice its own size at most, and the spectra by those of its
    slopes, because its levels have no line. A period that is not three times as far as the usual one is not marked,
    however little the distances spread.
    """
    typical = medians(periods, axis=0)
    level = period_levels(periods, typical)
    before, behind = slopes(level)
    far, size = period_reach(periods, typical)
    drift = np.abs(level).max() + max(np.abs(before).max(), np.abs(behind).max()) / 2
    slack = 2 * drift + _CLEAR * size.max()
    if not far.max() + slack < _FACTOR * (_usual(far) - slack):
        return False
    ramps = _ramps(periods.shape[1], bins)
    straight = lines() - np.multiply.outer(before, ramps[0]) - np.multiply.outer(behind, ramps[1])
    parts = straight.view(np.float64)
    middle = medians(parts, axis=0)
    away = (parts - middle) ** 2
    away = away[:, ::2] + away[:, 1::2]
    usual = medians(away, axis=0)
    if not usual.min() > (_CLEAR * size.max()) ** 2:
        return False
    at_lines = np.mean(away / (usual + (ROUNDING * middle[::2]) ** 2), axis=1)
    return bool(at_lines.max() < _FACTOR**2 * _usual(at_lines))


def _usual(distance: Floats) -> float:
    """The lower one of the two in the middle."""
    return float(np.sort(distance)[(distance.size - 1) // 2])


@lru_cache(maxsize=4)
def _ramps(period: int, bins: tuple[int, ...]) -> Complex:
    """Spectra of a slope of one a period before and behind the middle, shape (2, lines)."""
    position, middle = places(period)
    behind = np.arange(period) >= middle
    halves = np.array([position * ~behind, position * behind])
    return np.asarray(np.fft.rfft(halves, axis=1)[:, bins] * (2 / period))
