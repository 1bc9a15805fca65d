"""The clock of a live run: time of day of its samples, from their arrival at this computer."""

from __future__ import annotations

import time
from math import inf
from typing import TYPE_CHECKING

from livebode.core import Emit, Event, RunClock, ignore
from livebode.language import Message

if TYPE_CHECKING:
    from livebode.sources.live import LiveBlock, Origin

REFINED_FOR_S = 10.0
"""The relation is that of the Block with the least delay in the first so many seconds."""
REFINED_S = 0.05
"""Smallest improvement, in this time, that is recorded again."""
STEP_S = 1.0
"""Error of the relation from which a new one is used."""
_JUDGED_S = 60.0
_DRIFT_MAX = 0.005
"""Largest error of a sender's rate: samples whose delay grows faster are waiting in a queue."""
_PIECES_MAX = 1000


class ClockRelation:
    """Updates `clock` from the arrival of the Blocks of a live source.

    Samples can be delayed (broker, queue) but never early, so the Block with the least delay is the most accurate. A
    pause of unknown length, a sender with an inexact rate, and a change of the computer's clock begin another piece of
    the clock.

    Attributes
    ----------
    clock
        The present relation.
    """

    def __init__(self) -> None:
        self.clock = RunClock()
        self._unix_s = _unix_s_of_monotonic()
        self._since_s: float | None = None
        self._recorded_s: float | None = None
        self._stop = 0
        self._origin: Origin | None = None
        self._least = self._least_from_s = self._least_since_s = self._followed = inf

    def take(self, block: LiveBlock, emit: Emit = ignore) -> bool:
        """Whether the clock is to be recorded again with this Block; `emit` receives steps of the computer's clock."""
        if not len(block):
            return False
        arrived_s, start_s = block.arrived_s, block.origin_s + block.start / block.rate_hz
        unix_s = self._unix_s + arrived_s - (block.origin_s + block.stop / block.rate_hz)
        pieces = self.clock.pieces
        # If the sender's numbers continue, they give the length of a pause.
        unknown = block.gap and (block.start == self._stop or block.origin != self._origin)
        paused = self._since_s is None or unknown
        self._stop, self._origin = block.stop, block.origin
        if not pieces or (paused and abs(unix_s - pieces[-1][1]) > STEP_S):
            self._begin(start_s, unix_s, arrived_s)
            return True
        self._since_s = -inf if self._since_s is None else self._since_s  # a continued run has its relation
        if arrived_s - self._since_s <= REFINED_FOR_S:
            pieces[-1] = pieces[-1][0], min(unix_s, pieces[-1][1])
            return self._is_to_be_recorded(REFINED_S)
        return self._is_to_be_recorded(0.0) or self._judged(unix_s, start_s, block, emit)

    def _is_to_be_recorded(self, by_more_than_s: float) -> bool:
        newest_s = self.clock.pieces[-1][1]
        changed = self._recorded_s is not None and self._recorded_s - newest_s > by_more_than_s
        self._recorded_s = newest_s if changed else self._recorded_s
        return changed

    def _begin(self, from_s: float, unix_s: float, arrived_s: float) -> None:
        self.clock.pieces.append((from_s, unix_s))
        del self.clock.pieces[:-_PIECES_MAX]
        self._since_s, self._least, self._recorded_s = arrived_s, inf, unix_s
        self._followed = inf

    def _judged(self, unix_s: float, start_s: float, block: LiveBlock, emit: Emit) -> bool:
        """Whether the relation changed after a minute: the sender drifts, waited, or the clock was set."""
        if self._least == inf:
            self._least_from_s, self._least_since_s = start_s, block.arrived_s
        self._least = min(self._least, unix_s)
        if block.arrived_s - self._least_since_s <= _JUDGED_S:
            return False
        least, self._least = self._least, inf
        if self._was_set(start_s, block, emit):
            return True
        piece_s = self.clock.pieces[-1][1]
        before_s = piece_s if self._followed == inf else self._followed
        self._followed = min(least, before_s + _DRIFT_MAX * _JUDGED_S)
        if before_s - least > STEP_S:  # a large step: all previous samples had waited
            self.clock.pieces[-1] = self.clock.pieces[-1][0], least
            return True
        if abs(self._followed - piece_s) <= STEP_S:
            return False
        self._begin(self._least_from_s, self._followed, -inf)
        return True

    def _was_set(self, start_s: float, block: LiveBlock, emit: Emit) -> bool:
        """Whether this computer's clock was set in the last minute; then a new piece begins here."""
        by_s = _unix_s_of_monotonic() - self._unix_s
        if abs(by_s) <= STEP_S:
            return False
        self._unix_s += by_s
        message = Message(
            "this computer's clock was set by {set_by_s:+.4g} s; times of day before {before_s:.6g} s are unchanged",
            set_by_s=by_s,
            before_s=start_s,
        )
        emit(Event("computer-clock", block.start, start_s, message))
        self._begin(start_s, self._unix_s + block.arrived_s - (block.origin_s + block.stop / block.rate_hz), -inf)
        return True


def _unix_s_of_monotonic() -> float:
    return time.time() - time.monotonic()
