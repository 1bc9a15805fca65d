"""Samples cut into stretches of whole windows, with the samples before and after them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Stage
from livebode.monitoring.sample_buffer import SampleBuffer

WINDOWS = 10  # of a stretch: the lead is then half of the work, and an alarm at most a second late
LEAD_S = 0.5  # for a model to reach the machine's state; a Q of 10 at 50 Hz decays in 0.06 s


@dataclass(frozen=True, eq=False)
class WindowStretch:
    """Whole windows on the grid of sample numbers, the lead before them and up to a window after them.

    `data` (signals, samples) begins with sample number `start`, `first` and `last` are numbers of windows: window i
    has the samples i·N … i·N + N − 1. Samples before `settled` may come from a machine whose state is not known.
    """

    data: Floats
    start: int
    first: int
    last: int
    settled: int
    origin_s: float


class Stretches(SampleBuffer):
    """Cuts Blocks at places that depend on sample numbers alone; a gap ends a stretch."""

    _stage = Stage("stretches", 1)
    _STATE = ("_start", "_stop", "_next", "_settled", "_origin_s")

    def __init__(self, names: tuple[str, ...], window: int, rate_hz: float) -> None:
        super().__init__(names)
        self._window = window
        self._lead = max(round(LEAD_S * rate_hz), 2 * window)
        self._start, self._stop, self._next, self._settled, self._origin_s = 0, -1, 0, 0, 0.0

    def process(self, block: Block) -> list[WindowStretch]:
        """Stretches that this Block completes."""
        data = self._rows(block)
        done = self.finish() if self._stop >= 0 and (block.gap or block.start != self._stop) else []
        if self._stop < 0:
            self._start = block.start
            self._next = -(-block.start // self._window)
            self._settled = block.start + self._lead
        self._parts.append(data)
        self._stop, self._origin_s = block.stop, block.origin_s
        while self._stop >= (self._end() + 1) * self._window:
            done.append(self._cut(self._end()))
        return done

    def finish(self) -> list[WindowStretch]:
        """The remaining stretches, without a last window that has none after it; the next Block starts a new lead."""
        last = self._stop // self._window - 1
        done = [self._cut(last)] if self._stop >= 0 and last > self._next else []
        self._parts, self._stop = [], -1
        return done

    def _end(self) -> int:
        return (self._next // WINDOWS + 1) * WINDOWS

    def _cut(self, last: int) -> WindowStretch:
        data = np.concatenate(self._parts, axis=1)
        begin = max(self._start, self._next * self._window - self._lead)
        end = min((last + 1) * self._window, self._stop)
        cut = data[:, begin - self._start : end - self._start]
        stretch = WindowStretch(cut, begin, self._next, last, self._settled, self._origin_s)
        self._next = last
        keep = max(self._start, last * self._window - self._lead)
        self._parts, self._start = [data[:, keep - self._start :].copy()], keep
        return stretch
