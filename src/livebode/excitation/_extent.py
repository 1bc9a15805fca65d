"""The part of the recording in which the excitation runs."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.excitation.blocks import cut

# Cutting off a start-up loses a whole period at the other end, so a shorter one (as a share of the period) remains, and
# its period is marked as transient.
_SHORTEST = 0.05


def extent(x: Floats, period: int) -> tuple[int, int]:
    """First sample of the periodic part and the sample after its last.

    Each period is compared with the typical one, the median of those that agree with their neighbours. Where the
    projection on it is below one half, the excitation does not run. The border inside a period is where the
    sum of squares of "only a level" before it and of "the typical period" after it is least.
    The whole recording where less than two periods would remain. Silence in the middle is not cut out: its
    periods are outlying.
    """
    if x.size < 2 * period:
        return 0, x.size
    blocks = cut(x, period)
    together = np.sum(blocks[:-1] * blocks[1:], axis=1)
    agree = np.flatnonzero(together >= 0.5 * np.quantile(together, 0.9))
    if not agree.size:
        return 0, x.size
    members = np.union1d(agree, agree + 1)
    typical = np.median(blocks[members], axis=0)
    typical -= typical.mean()
    runs = np.flatnonzero(blocks @ typical >= 0.5 * typical @ typical)
    if not runs.size:
        return 0, x.size
    start = _border(x, typical, int(runs[0]))
    whole = x.size // period
    flipped = _border(x[: whole * period][::-1], typical[::-1], whole - 1 - int(runs[-1]))
    stop = x.size if flipped == 0 else whole * period - flipped
    return (start, stop) if stop - start >= 2 * period else (0, x.size)


def _border(x: Floats, typical: Floats, silent: int) -> int:
    # `silent` periods lead; the border is in the last of them or in the one after.
    period = typical.size
    first, last = max(silent - 1, 0) * period, min((silent + 1) * period, x.size)
    part = x[first:last]
    expected = np.resize(typical, part.size)
    runs_level = float(np.median(part[-period:] - expected[-period:]))
    silence_level = float(np.median(x[: silent * period])) if silent else runs_level
    silence, runs = (part - silence_level) ** 2, (part - runs_level - expected) ** 2
    gain = np.concatenate(([0.0], np.cumsum(silence - runs)))
    index = int(np.argmin(gain))
    # Silence must fit clearly: half the squares of the excitation's, not a few samples near its zero.
    clear = np.sum(silence[:index]) <= 0.5 * np.sum(runs[:index])
    border = first + index if clear else first
    return border if border >= _SHORTEST * period else 0
