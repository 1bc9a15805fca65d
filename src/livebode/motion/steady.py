"""Windows of steady motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.motion.chunk import Chunk

_UNEVEN = 0.1
_STANDSTILL = 0.5
FLAT_M = 1e-3  # a chunk with less travel has no curves to fit


def steady_rows(sample: NDArray[np.int64], chunk: Chunk, window: int) -> NDArray[np.bool_]:
    """Rows whose window and the previous one have a constant speed that is near the usual one.

    Elsewhere accelerations excite oscillations, and dry friction may stop the axis. Constant: the travel of the two
    windows differs by up to 10 % from twice that of one. Near the usual speed: at least half of the farthest travel of
    the stretch, and more than 1 mm.
    """
    x, last = chunk.x, sample - chunk.start
    known = last >= 2 * window
    here, middle, there = (x[(last - back).clip(0)] for back in (0, window, 2 * window))
    travel = np.abs(here - there)
    even = np.abs(here - 2 * middle + there) <= _UNEVEN * travel
    return np.asarray(known & even & (travel >= max(_STANDSTILL * np.max(travel, initial=0.0), FLAT_M)))
