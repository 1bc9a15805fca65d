"""The period of an excitation without the mains hum beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import MAINS_HZ, meets_mains
from livebode.excitation.blocks import cut, spectra
from livebode.excitation.doubtful import with_lines_beside
from livebode.excitation.significance import BinClasses, find_lines

_MAINS_DRIFT = 2e-3  # of its frequency
_NEAR_BINS = 0.1  # the period is a multiple of the hum's, otherwise the recording would not repeat after it
# Hum has at most a tenth of the power, and half of the amplitude of the middle line. Otherwise a design with lines at
# multiples of 50 or 60 Hz would lose them.
_POWER_MAX, _LEVEL_MAX = 0.1, 0.5
_WEAK = 0.1  # of the strongest line
_ORDER_MAX = 2  # of the lowest hum: 50 Hz, or 100 Hz of a rectifier
_BELOW_ORDER = 6.5  # hum begins there, at the sixth harmonic of a six-pulse rectifier, at the latest
_BELOW_BESIDE = 0.125  # 18 dB below the lines on both sides: the amplitudes of a design are smooth
_FAR_BELOW = 0.05  # 26 dB: few designs have lines that far apart, and then hardly at the mains alone


def without_mains(calm: Floats, period: int, rate_hz: float, step: float) -> int:
    """The shortest divisor of a period at whose harmonics all lines are, except hum at harmonics of the mains.

    Parameters
    ----------
    calm
        Periodic part of the recording, shape (samples,).
    period
        Samples after which the excitation and the hum together repeat.
    rate_hz
        Samples per second.
    step
        The samples are multiples of it; 0 for none.
    """
    classes = with_lines_beside(find_lines(spectra(cut(calm, period)), step=step), rate_hz / period)
    bins = np.flatnonzero(classes.excited)
    if not bins.size:
        return period
    level, resolution_hz = classes.amplitude[bins], rate_hz / period
    at_mains = [(mains_hz, _at_harmonics(bins, resolution_hz, mains_hz)) for mains_hz in MAINS_HZ]
    for shorter in (divisor for divisor in range(1, period) if period % divisor == 0):
        on = bins % (period // shorter) == 0
        if on.all():
            return shorter
        hum = [
            hz
            for hz, harmonic in at_mains
            if harmonic[~on].all() and np.min(bins[~on]) * resolution_hz < hz * _BELOW_ORDER
        ]
        if on.any() and hum and _weaker(level[~on], level[on]):
            return shorter
    return period


def separate_hum(classes: BinClasses, resolution_hz: float) -> BinClasses:
    """Count weak lines at harmonics of the mains as distortion, if all lines, or those beside, are much stronger."""
    bins = np.flatnonzero(classes.excited)
    if not bins.size:
        return classes
    level = classes.amplitude[bins]
    for mains_hz in MAINS_HZ:
        harmonic = _at_harmonics(bins, resolution_hz, mains_hz)
        weak = harmonic & (level <= _FAR_BELOW * level.max())
        if weak.any() and level[weak].max() > _FAR_BELOW * level[~weak].min():
            weak[:] = False
        weak |= harmonic & (level <= _BELOW_BESIDE * _beside(level, harmonic))
        order = np.rint(bins[weak] * resolution_hz / mains_hz)
        if np.any(order <= _ORDER_MAX):
            hum = np.isin(np.arange(classes.excited.size), bins[weak])
            return replace(classes, excited=classes.excited & ~hum, distortion=classes.distortion | hum)
    return classes


def _at_harmonics(bins: NDArray[np.intp], resolution_hz: float, mains_hz: float) -> NDArray[np.bool_]:
    return meets_mains(bins, resolution_hz, (mains_hz,), _NEAR_BINS + _MAINS_DRIFT * bins)


def _beside(level: Floats, harmonic: NDArray[np.bool_]) -> Floats:
    """Level of the weaker neighbour of each line, of those that are not at the mains; 0 without one on both sides."""
    others = np.flatnonzero(~harmonic)
    after = np.searchsorted(others, np.arange(level.size))
    inside = (after > 0) & (after < others.size)
    weaker = np.zeros(level.size)
    weaker[inside] = np.minimum(level[others[after[inside] - 1]], level[others[after[inside]]])
    return weaker


def _weaker(hum: Floats, lines: Floats) -> bool:
    middle = np.median(lines[lines >= _WEAK * lines.max()])
    return bool(np.sum(hum**2) <= _POWER_MAX * np.sum(lines**2) and hum.max() <= _LEVEL_MAX * middle)
