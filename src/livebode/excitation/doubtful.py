"""Weak bins beside strong lines: designed lines, or distortion of the strong ones."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.core import SignalError, meets_mains
from livebode.excitation.significance import BinClasses

# Of the strongest line, 26 dB: distortion of a good drive is below, and designed lines are above.
_DESIGNED = 0.05
_NEAR_BINS, _MAINS_DRIFT = 0.1, 2e-3  # of a bin, and of the frequency, which wanders by 0.1 Hz around 50 Hz
_HUM_HZ_MAX = 400.0  # hum of this level is at the first harmonics of the mains
_HARMONICS_MAX = 20  # of a single line; higher ones of this level do not exist


def with_lines_beside(classes: BinClasses, resolution_hz: float) -> BinClasses:
    """Count strong bins as lines which are no harmonic of the other lines, and not at the mains.

    Distortion is at multiples of the largest common factor of the lines: what repeats with the excitation elsewhere was
    designed.
    """
    lines = np.flatnonzero(classes.excited)
    beside = _strong_distortion(classes)
    hum = meets_mains(beside, resolution_hz, near_bins=_NEAR_BINS + _MAINS_DRIFT * beside)
    beside = beside[~hum | (beside * resolution_hz > _HUM_HZ_MAX)]
    if lines.size and beside.size:
        common = reduce(gcd, map(int, lines))
        order = beside // common
        beside = beside[(beside % common != 0) | ((lines.size == 1) & (order > _HARMONICS_MAX))]
    if not lines.size or not beside.size:
        return classes
    designed = np.isin(np.arange(classes.excited.size), beside)
    return replace(classes, excited=classes.excited | designed, distortion=classes.distortion & ~designed)


def without_junk(classes: BinClasses, snr_db: NDArray[np.float64]) -> BinClasses:
    """Count weak lines as distortion that the output does not show: 26 dB below the visible ones, and below its noise.

    Parameters
    ----------
    snr_db
        At the output, shape (bins,); `snr.snr_db`.
    """
    visible = classes.excited & (snr_db > 0)
    if not visible.any():
        return classes
    junk = classes.excited & (snr_db < 0) & (classes.amplitude < _DESIGNED * np.median(classes.amplitude[visible]))
    return replace(classes, excited=classes.excited & ~junk, distortion=classes.distortion | junk)


def refuse_if_doubtful(classes: BinClasses, period: int, rate_hz: float) -> None:
    """SignalError if there is one strong bin beside a single line: two designed lines look alike."""
    lines = np.flatnonzero(classes.excited)
    beside = _strong_distortion(classes)
    if lines.size != 1 or beside.size != 1:
        return
    fewer, more = (", ".join(f"{k * rate_hz / period:.6g}" for k in bins) for bins in (lines, (*lines, *beside)))
    share = classes.amplitude[beside[0]] / classes.amplitude[lines[0]]
    candidates = [f"--lines {text.replace(', ', ',')} --window {period}" for text in (fewer, more)]
    raise SignalError(
        "lines-ambiguous",
        f"cannot tell whether the excitation has one line ({fewer} Hz) with distortion or hum of {100 * share:.0f} %, "
        f"or two lines ({more} Hz)",
        f"give {candidates[0]}, or {candidates[1]}",
        candidates=candidates,
        period=period,
    )


def _strong_distortion(classes: BinClasses) -> NDArray[np.intp]:
    return np.flatnonzero(classes.distortion & (classes.amplitude >= _DESIGNED * classes.amplitude.max()))
