"""Periods that a shorter lag hides: multiples with a weak line in between, and periods that are no whole number."""

from __future__ import annotations

from math import gcd

import numpy as np

from livebode.arrays import Floats
from livebode.excitation.blocks import cut, spectra
from livebode.excitation.doubtful import with_lines_beside
from livebode.excitation.repetition import LAG_MIN, ROUNDING
from livebode.excitation.significance import find_lines

_SIGMAS = 5.0
_OFF_MIN = 0.1  # samples: two clocks, one for the excitation and one for the recorder, differ by less
_TIMES_MAX = 8  # of a period that is not whole; more are rarely recorded twice
_PRECISE = 0.1  # samples: a multiple is whole if it is known as precisely as that


def longer_period(x: Floats, period: int, rate_hz: float, d: Floats) -> int:
    """The period of which `period` is a part at the strong lines only.

    A line of a tenth of the power may have no common factor with the others; then the recording repeats much better
    after a multiple, at which that line is found. A strong line may also repeat after a number of samples that is not
    whole, such as 166.67; then its phase drifts from one period to the next, and three periods are one window.

    Parameters
    ----------
    x
        Periodic part of the recording, shape (samples,).
    period
        The lag at which it repeats, samples.
    rate_hz
        Samples per second.
    d
        Its difference at each lag, `repetition.difference`.
    """
    multiple = _multiple(x, period, rate_hz, d)
    if multiple != period:
        return multiple
    whole = _whole_multiple(x, period)
    if 2 * whole > x.size:
        return period
    chance = 1 + _SIGMAS * 2 * np.sqrt(2 / (x.size - whole))
    return whole if d[whole] <= max(d[period], 0.0) * chance + ROUNDING else period


def _multiple(x: Floats, period: int, rate_hz: float, d: Floats) -> int:
    lags = np.arange(period, x.size // 2 + 1, period)
    if lags.size < 2:
        return period
    lag = int(lags[np.argmax(d[lags] <= 2 * max(float(d[lags].min()), 0.0) + ROUNDING)])
    if 2 * max(float(d[lag]), 0.0) + ROUNDING >= d[period]:
        return period
    classes = with_lines_beside(find_lines(spectra(cut(x, lag))), rate_hz / lag)
    lines = np.flatnonzero(classes.excited)
    common = gcd(lag, *map(int, lines))
    return lag // common if lines.size and lag // common > period else period


def _whole_multiple(x: Floats, period: int) -> int:
    """The nearest whole number of samples with a whole number of true periods; `period` if it is not known better."""
    off, deviation = period_error(x, period)
    if abs(off) < max(_OFF_MIN, _SIGMAS * deviation):
        return period
    for times in range(1, _TIMES_MAX + 1):
        length = times * (period + off)
        if _SIGMAS * times * deviation > 0.5 - _PRECISE:
            break
        if abs(length - round(length)) <= _PRECISE + 2 * times * deviation and round(length) >= LAG_MIN:
            return round(length)
    return period


def period_error(x: Floats, period: int) -> tuple[float, float]:
    """True period minus `period` in samples, and its standard deviation; (0, inf) if it cannot be determined.

    At line k the phase drifts by −2πk·error/period from one period to the next. Least squares over the lines, weighted
    by their powers, with the scatter of the residuals.

    Examples
    --------
    >>> x = np.cos(2 * np.pi * 3 * np.arange(1500) / 500)
    >>> round(period_error(x, 167)[0], 2)
    -0.33
    """
    periods = spectra(cut(x, period))
    lines = np.flatnonzero(find_lines(periods).excited)
    count = len(periods)
    if count < 3 or not lines.size:
        return 0.0, np.inf
    phase = np.unwrap(np.angle(periods[:, lines]), axis=0)
    phase -= phase.mean(axis=0)
    weight = np.abs(periods[:, lines].mean(axis=0)) ** 2
    number = (np.arange(count) - (count - 1) / 2)[:, np.newaxis]
    slope = -2 * np.pi * lines / period * number  # of the phase, per sample of error
    squares = float(np.sum(weight * slope**2))
    error = float(np.sum(weight * slope * phase)) / squares
    left = float(np.sum(weight * (phase - error * slope) ** 2)) / (lines.size * (count - 1) - 1)
    return error, float(np.sqrt(left / squares))
