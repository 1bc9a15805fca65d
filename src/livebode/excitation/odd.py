"""Odd lines with detection lines between them, which separate distortion from noise."""

from __future__ import annotations

from collections.abc import Collection
from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.core import WINDOW_MAX, GridError, Lines, UsageError, check_window

_GROUP_MIN = 2
_DRAWS = 100


def odd_lines(
    low_hz: float,
    high_hz: float,
    rate_hz: float,
    window: int,
    *,
    group: int = 4,
    seed: int = 0,
    without: Collection[int] = (),
) -> Lines:
    """The odd bins of a band; one in every `group` neighbours, drawn at random, is not excited, but neither end.

    With such lines and random phases, the even bins show even distortion of the machine, and the odd bins without
    excitation show odd distortion, each in addition to the noise (Pintelon, Schoukens, System Identification, 2nd ed.,
    2012, ch. 4: random odd multisine with a random harmonic grid). The price is half the resolution of a grid of all
    bins.

    Parameters
    ----------
    low_hz, high_hz
        The band, ends included.
    rate_hz, window
        The tracker's grid.
    group
        Odd bins of which one is not excited.
    seed
        Of the draw: the same seed gives the same lines.
    without
        Bins that are never excited, such as those of the mains; the groups are formed from the others.

    Raises
    ------
    GridError
        If the band is not between 0 and the Nyquist frequency, or has fewer odd bins than one group.

    Examples
    --------
    >>> odd_lines(20, 140, rate_hz=4000, window=800, seed=1).bins
    (5, 7, 11, 13, 15, 19, 21, 23, 27)
    """
    check_window(window, rate_hz)
    check_band(low_hz, high_hz, rate_hz)
    if group < _GROUP_MIN:
        raise UsageError(
            "out-of-range",
            f"{group=} excites no line",
            f"choose {_GROUP_MIN} or more, such as 4",
            argument="group",
            value=group,
            low=_GROUP_MIN,
        )
    odd = odd_bins(low_hz, high_hz, rate_hz, window)
    odd = odd[~np.isin(odd, list(without))]
    if odd.size < group:
        raise GridError(
            "band-too-narrow",
            f"{low_hz:g} … {high_hz:g} Hz has {odd.size} odd bins of the {rate_hz / window:g} "
            f"Hz grid, less than one group of {group}",
            f"take {wider(high_hz - low_hz, 2 * group, window, rate_hz)}",
            argument="band_hz",
            low_hz=low_hz,
            high_hz=high_hz,
            resolution_hz=rate_hz / window,
        )
    generator, ends = np.random.default_rng(seed), odd[[0, -1]].tolist()
    groups = [odd[i : i + group] for i in range(0, odd.size - group + 1, group)]
    inner = [g[(g != ends[0]) & (g != ends[1])] if odd.size > _GROUP_MIN else g for g in groups]
    for _ in range(_DRAWS):
        silent = [generator.choice(g) for g in inner]
        bins = odd[~np.isin(odd, silent)].tolist()
        # With a common factor they would repeat within the window, on a grid without detection lines.
        if gcd(window, *bins) == 1:
            break
    return Lines.of_bins(bins, window, rate_hz)


def odd_bins(low_hz: float, high_hz: float, rate_hz: float, window: int) -> NDArray[np.int64]:
    """The odd bins of a band, ends included, below the Nyquist frequency."""
    first, last = int(np.ceil(low_hz * window / rate_hz - 1e-9)), int(np.floor(high_hz * window / rate_hz + 1e-9))
    odd = np.arange(max(first, 1) + (max(first, 1) + 1) % 2, last + 1, 2)
    return np.asarray(odd[2 * odd < window])


def check_band(low_hz: float, high_hz: float, rate_hz: float) -> None:
    """Raise GridError for an invalid band, or one that the rate does not permit."""
    if not 0 < low_hz <= high_hz:
        raise GridError(
            "band-invalid",
            f"{low_hz:g} … {high_hz:g} Hz is not a band",
            "specify two frequencies above 0, the lower one first",
            argument="band_hz",
            low_hz=low_hz,
            high_hz=high_hz,
        )
    if not high_hz < rate_hz / 2:
        raise GridError(
            "above-nyquist",
            f"the band ends at {high_hz:g} Hz, not below the Nyquist frequency {rate_hz / 2:g} Hz of {rate_hz:g} Hz",
            f"end it at {0.45 * rate_hz:g} Hz, or sample at {2.5 * high_hz:g} Hz",
            argument="band_hz",
            high_hz=high_hz,
            rate_hz=rate_hz,
        )


def wider(band_hz: float, bins: int, window: int, rate_hz: float) -> str:
    """The remedy for a band narrower than this number of bins: a longer window if that is enough, or a wider band."""
    if band_hz * WINDOW_MAX < bins * rate_hz:
        return "a wider band"
    return f"a window of {max(int(np.ceil(bins * rate_hz / band_hz)), window + 1)} samples, or a wider band"
