"""A recording whose channels have clocks of their own, cut into segments of the common grid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from livebode.arrays import Floats
from livebode.sources import UnevenLog


def segments(
    log: UnevenLog, channels: Sequence[str], first: int, stop: int, step: int
) -> Iterator[tuple[Floats, Floats]]:
    """Times and samples in each of the segments `first` … `stop` − 1, of `step` samples of the grid.

    A segment begins half a sample before its first one on the grid. Times are in samples of the grid, shape (samples,);
    samples (channels, samples).
    """
    number, at = first, np.zeros(0)
    data = np.zeros((len(channels), 0))
    pieces = log.pieces(channels)
    while number < stop:
        piece = next(pieces, None)
        if piece is not None:
            at = np.concatenate([at, piece[0] * log.rate_hz])
            data = np.concatenate([data, piece[1]], axis=1)
        ends = np.arange(number, stop + 1) * step - 0.5
        if piece is not None:
            # The last sample shows that every segment before it is complete.
            ends = ends[: int(np.searchsorted(ends, at[-1], side="right"))] if at.size else ends[:0]
        cuts = np.searchsorted(at, ends)
        for begin, end in pairwise(cuts):
            yield at[begin:end], data[:, begin:end]
            number += 1
        done = int(cuts[-1]) if cuts.size else 0
        at, data = at[done:], data[:, done:]
