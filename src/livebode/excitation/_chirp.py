"""A periodic sweep from one frequency to another."""

from __future__ import annotations

from typing import Literal

import numpy as np

from livebode.arrays import Floats
from livebode.core import GridError, Lines, UsageError, check_window
from livebode.excitation.odd import check_band, wider

Sweep = Literal["linear", "logarithmic"]


def chirp(
    low_hz: float,
    high_hz: float,
    rate_hz: float,
    window: int,
    amplitude: float = 1.0,
    *,
    sweep: Sweep = "linear",
) -> Floats:
    """One period of amplitude·sin φ(n), whose frequency goes from low to high within it, shape (window,).

    The angle over a whole period is a whole number of turns, so that the next period begins where this one ends: low
    and high frequency are rounded to bins for a linear sweep (with an even sum), and scaled by at most half
    a turn in total for a logarithmic one. The frequency jumps back at the border, the signal does not. Crest factor √2;
    lines at all bins of the band, of nearly equal size in a linear sweep, falling by 3 dB an octave in a logarithmic
    one, and at half their size at the ends.

    Raises
    ------
    GridError
        If the band is not between 0 and the Nyquist frequency, or is not wider than two bins.
    UsageError
        If the sweep is not supported.

    Examples
    --------
    >>> period = chirp(20, 140, rate_hz=4000, window=4000)
    >>> round(float(np.max(np.abs(period)) / np.std(period)), 2)
    1.41
    """
    chirp_lines(low_hz, high_hz, rate_hz, window)
    if sweep not in ("linear", "logarithmic"):
        raise UsageError(
            "not-one-of",
            f"{sweep=} is not supported",
            "choose 'linear' or 'logarithmic'",
            argument="sweep",
            value=sweep,
            allowed=["linear", "logarithmic"],
        )
    low, high = low_hz * window / rate_hz, high_hz * window / rate_hz  # turns in a window
    share = np.arange(window) / window
    if sweep == "linear":
        first = round(low)
        turns = first * share + round((high - first) / 2) * share**2
    else:
        ratio = np.log(high / low)
        whole = max(1, round((high - low) / ratio))
        turns = whole * np.expm1(ratio * share) / np.expm1(ratio)
    return np.asarray(amplitude * np.sin(2 * np.pi * turns))


def chirp_lines(low_hz: float, high_hz: float, rate_hz: float, window: int) -> Lines:
    """The bins of the band, all excited."""
    check_window(window, rate_hz)
    check_band(low_hz, high_hz, rate_hz)
    first, last = int(np.ceil(low_hz * window / rate_hz - 1e-9)), int(np.floor(high_hz * window / rate_hz + 1e-9))
    first = max(first, 1)
    if last - first < 2:
        raise GridError(
            "band-too-narrow",
            f"{low_hz:g} … {high_hz:g} Hz is not wider than two bins of {rate_hz / window:g} Hz",
            f"take {wider(high_hz - low_hz, 3, window, rate_hz)}",
            argument="band_hz",
            low_hz=low_hz,
            high_hz=high_hz,
            resolution_hz=rate_hz / window,
        )
    return Lines.of_bins(list(range(first, last + 1)), window, rate_hz)
