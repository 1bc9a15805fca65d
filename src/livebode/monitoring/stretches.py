"""Samples cut into stretches of whole windows, with the samples around them, or into sections of one length."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Stage, StatefulBase
from livebode.dataclass import dataclass


class SampleBuffer(StatefulBase):
    """Base class of what cuts Blocks into pieces of other lengths; the state contains the samples in `_parts`."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._parts: list[Floats] = []

    def _rows(self, block: Block) -> Floats:
        """The channels of a Block, (channels, samples); LivebodeError where one is missing."""
        return block.data[[block.index(name) for name in self._names]]

    def _state(self) -> dict[str, Any]:
        data = np.concatenate(self._parts, axis=1) if self._parts else np.zeros((len(self._names), 0))
        return super()._state() | {"data": data}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._parts = [state["data"]] if state["data"].size else []


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


SECTION_S = 10.0
"""Length of a section: some strokes, and an alarm about friction or orders at most half a minute late."""


@dataclass(frozen=True, eq=False)
class SampleSection:
    """Samples without a gap, (channels, samples); the number of the newest one, and the time of the middle."""

    data: Floats
    sample: int
    time_s: float


class Sections(SampleBuffer):
    """Cuts Blocks into sections on the grid of sample numbers; a section with a gap or a bad sample is left out."""

    _stage = Stage("sections", 1)
    _STATE = ("_start", "_stop")

    def __init__(self, names: tuple[str, ...], rate_hz: float) -> None:
        super().__init__(names)
        self._rate_hz, self._size = rate_hz, round(SECTION_S * rate_hz)
        self._start, self._stop = 0, -1

    def process(self, block: Block) -> list[SampleSection]:
        """Sections that this Block completes; LivebodeError where a channel is missing."""
        data = self._rows(block)
        if block.gap or block.start != self._stop:
            self._parts, self._start = [], block.start
        self._parts.append(data)
        self._stop = block.stop
        done: list[SampleSection] = []
        while self._stop >= (end := (self._start // self._size + 1) * self._size):
            cut = np.concatenate(self._parts, axis=1)
            part, remainder = np.split(cut, [end - self._start], axis=1)
            if part.shape[1] == self._size and np.isfinite(part).all():
                done.append(SampleSection(part, end - 1, block.origin_s + (end - self._size / 2) / self._rate_hz))
            self._parts, self._start = [remainder.copy()], end
        return done
