"""Lines affected by the mains: harmonics of 50 and 60 Hz, which repeat as an excitation does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.core import Lines

MAINS_HZ = (50.0, 60.0)
_NEAR_BINS = 0.5  # from a harmonic: farther away, at most 40 % of its power is in a window's bin


def meets_mains(bins: Sequence[int], resolution_hz: float, mains_hz: Sequence[float]) -> NDArray[np.bool_]:
    """Which bins are within half a bin of a harmonic, shape (bins,).

    >>> meets_mains([3, 5, 6, 7], 10.0, (50.0, 60.0)).tolist()
    [False, True, True, False]
    """
    f = np.asarray(bins) * resolution_hz
    near = np.zeros(f.shape, dtype=np.bool_)
    for mains in mains_hz:
        harmonic = mains * np.maximum(np.round(f / mains), 1)
        near |= np.abs(f - harmonic) < _NEAR_BINS * resolution_hz * (1 - 1e-9)
    return near


def mains_words(lines: Lines, mains_hz: Sequence[float], avoided: Sequence[int]) -> str:
    """Effect of the mains on the lines, for the table of a design; a warning where a line meets a harmonic."""
    left_out = ", ".join(f"{k * lines.resolution_hz:g}" for k in avoided)
    words = f"no line at {left_out} Hz" if avoided else ""
    met = lines.frequency_hz[meets_mains(lines.bins, lines.resolution_hz, mains_hz)]
    if met.size:
        shown = ", ".join(f"{f:g}" for f in met[:6]) + (" …" if met.size > 6 else "")
        return "; ".join(filter(None, (words, f"WARNING: hum adds to the lines at {shown} Hz; move them, or refine")))
    return words or "no line within half a bin of a harmonic"
