"""Signals as a page draws them: the smallest and the largest sample of each of some hundred pieces."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.sources import Log

OVERVIEW_PIECES = 1 << 16
POINTS_MAX = 4096
_Extremes = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class SignalOverview:
    """Extremes of whole channels, from which those of most spans follow without another reading.

    Attributes
    ----------
    log
        The recording.
    stop
        Number of the sample after its last one.
    names
        The channels.
    low, high
        Shape (channels, pieces); NaN where a piece has no finite sample.
    """

    log: Log
    stop: int
    names: tuple[str, ...]
    low: Floats
    high: Floats

    @classmethod
    def read(cls, log: Log, names: Sequence[str], stop: int) -> SignalOverview:
        """Read the channels once."""
        return cls(log, stop, tuple(names), *extremes(log, names, log.first, stop, OVERVIEW_PIECES))

    def plain(self, name: str, from_s: float, to_s: float, points: int) -> dict[str, Any]:
        """The channel in a span of time, for JSON: time of the first piece, s between them, low and high, None for NaN.

        The pieces are samples where there are at most `points` of these.
        """
        log, rate_hz = self.log, self.log.rate_hz
        first = int(np.clip((from_s - log.origin_s) * rate_hz, log.first, self.stop - 1))
        stop = int(np.clip(ceil((to_s - log.origin_s) * rate_hz) + 1, first + 1, self.stop))
        own, wanted = _samples(self.stop - log.first, OVERVIEW_PIECES), _samples(stop - first, points)
        if wanted < own:
            low, high = (part[0] for part in extremes(log, [name], first, stop, points))
        else:
            row, wanted = self.names.index(name), wanted // own * own
            begin, end = (first - log.first) // own, ceil((stop - log.first) / own)
            first = log.first + begin * own
            step = np.arange(0, end - begin, wanted // own)
            low = np.fmin.reduceat(self.low[row, begin:end], step)
            high = np.fmax.reduceat(self.high[row, begin:end], step)
        return {
            "from_s": log.origin_s + first / rate_hz,
            "step_s": wanted / rate_hz,
            "low": _plain(low),
            "high": None if wanted == 1 else _plain(high),
        }


def extremes(log: Log, names: Sequence[str], first: int, stop: int, points: int) -> _Extremes:
    """Smallest and largest finite sample of at most `points` pieces between two samples, shape (channels, pieces)."""
    size = _samples(stop - first, points)
    low = np.full((len(names), ceil((stop - first) / size)), np.nan)
    high = low.copy()
    for block in log.part(first, stop).blocks(names):
        data = np.where(np.isfinite(block.data), block.data, np.nan)
        piece = (np.arange(block.start, block.stop) - first) // size
        begins = np.flatnonzero(np.diff(piece, prepend=-1))
        columns = piece[begins]
        low[:, columns] = np.fmin(low[:, columns], np.fmin.reduceat(data, begins, axis=1))
        high[:, columns] = np.fmax(high[:, columns], np.fmax.reduceat(data, begins, axis=1))
    return low, high


def _samples(length: int, points: int) -> int:
    """Samples of a piece."""
    return max(1, ceil(length / points))


def _plain(values: Floats) -> list[float | None]:
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
