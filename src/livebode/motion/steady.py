"""Which windows belong to a steady motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.motion.chunk import Chunk

_UNEVEN = 0.1
_STANDING = 0.5
FLAT_M = 1e-3  # a chunk that travels less has no curves to fit


def steady_rows(sample: NDArray[np.int64], chunk: Chunk, window: int) -> NDArray[np.bool_]:
    """Rows during whose window, and the window before it, the axis travelled evenly and about as fast as it does.

    Elsewhere accelerations ring, and dry friction may hold. Even is a travel of the two windows that differs by up to
    10 % of it from twice that of one; about as fast is half the farthest travel of the stretch, and more than 1 mm.
    """
    x, last = chunk.x, sample - chunk.start
    known = last >= 2 * window
    here, middle, there = (x[(last - back).clip(0)] for back in (0, window, 2 * window))
    travel = np.abs(here - there)
    even = np.abs(here - 2 * middle + there) <= _UNEVEN * travel
    return np.asarray(known & even & (travel >= max(_STANDING * np.max(travel, initial=0.0), FLAT_M)))
