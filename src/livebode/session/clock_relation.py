"""The clock of a live run: which time of day its samples are, by their arrival at this computer."""

from __future__ import annotations

import time
from math import inf

from livebode.nouns.clock import RunClock
from livebode.sources.live import LiveBlock

REFINED_FOR_S = 10.0
"""From its first Block on the relation is that of the Block with the least delay of so many seconds."""
REFINED_S = 0.05
"""By so much it is better before it is recorded again meanwhile."""
STEP_S = 1.0
"""By so much the relation is wrong before another one is used from there on."""
_DRIFT_OVER_S = 60.0
_PIECES_MAX = 1000


class ClockRelation:
    """Keeps `clock` from the arrival of the Blocks of a live source.

    Samples wait on the way (a broker, a queue), never the other way round, so that the least delayed Block tells the
    most. A pause of unknown length, and a sender whose rate is not exact, begin another piece of the clock.

    Attributes
    ----------
    clock
        The relation as it is known.
    """

    def __init__(self) -> None:
        self.clock = RunClock()
        self._unix_s = time.time() - time.monotonic()
        self._since_s: float | None = None
        self._recorded_s: float | None = None
        self._least = self._least_from_s = self._least_since_s = inf

    def take(self, block: LiveBlock) -> bool:
        """Whether the clock is to be recorded again with this Block."""
        if not len(block):
            return False
        arrived_s, start_s = block.arrived_s, block.origin_s + block.start / block.rate_hz
        unix_s = self._unix_s + arrived_s - (block.origin_s + block.stop / block.rate_hz)
        pieces = self.clock.pieces
        paused = self._since_s is None or block.gap
        if not pieces or (paused and abs(unix_s - pieces[-1][1]) > STEP_S):
            self._begin(start_s, unix_s, arrived_s)
            return True
        self._since_s = -inf if self._since_s is None else self._since_s  # a run that is continued has its relation
        if arrived_s - self._since_s <= REFINED_FOR_S:
            pieces[-1] = pieces[-1][0], min(unix_s, pieces[-1][1])
            return self._is_to_be_recorded(REFINED_S)
        return self._is_to_be_recorded(0.0) or self._drifts(unix_s, start_s, arrived_s)

    def _is_to_be_recorded(self, by_more_than_s: float) -> bool:
        newest_s = self.clock.pieces[-1][1]
        changed = self._recorded_s is not None and self._recorded_s - newest_s > by_more_than_s
        self._recorded_s = newest_s if changed else self._recorded_s
        return changed

    def _begin(self, from_s: float, unix_s: float, arrived_s: float) -> None:
        self.clock.pieces.append((from_s, unix_s))
        del self.clock.pieces[:-_PIECES_MAX]
        self._since_s, self._least, self._recorded_s = arrived_s, inf, unix_s

    def _drifts(self, unix_s: float, start_s: float, arrived_s: float) -> bool:
        """Whether the least delay of a minute is another one."""
        if self._least == inf:
            self._least_from_s, self._least_since_s = start_s, arrived_s
        self._least = min(self._least, unix_s)
        if arrived_s - self._least_since_s <= _DRIFT_OVER_S:
            return False
        least, self._least = self._least, inf
        if abs(least - self.clock.pieces[-1][1]) <= STEP_S:
            return False
        self._begin(self._least_from_s, least, -inf)
        return True
