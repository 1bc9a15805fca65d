"""Which windows belong to a steady motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import Block

_UNEVEN = 0.1
_STANDING = 0.5


def steady_rows(sample: NDArray[np.int64], signals: Block, window: int) -> NDArray[np.bool_]:
    """Rows during whose window, and the window before it, the axis travelled evenly and about as fast as it does.

    Elsewhere accelerations ring, and dry friction may hold. Even is a travel of the two windows that differs by up to
    10 % of it from twice that of one; about as fast is half the farthest travel of the stretch.
    """
    x, last = signals["x"], sample - signals.start
    known = last >= 2 * window
    here, middle, there = (x[(last - back).clip(0)] for back in (0, window, 2 * window))
    travel = np.abs(here - there)
    even = np.abs(here - 2 * middle + there) <= _UNEVEN * travel
    return np.asarray(known & even & (travel >= _STANDING * np.max(travel, initial=0.0)))
