"""Samples cut into sections of one length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Stage
from livebode.monitoring.sample_buffer import SampleBuffer

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
            part, rest = np.split(cut, [end - self._start], axis=1)
            if part.shape[1] == self._size and np.isfinite(part).all():
                done.append(SampleSection(part, end - 1, block.origin_s + (end - self._size / 2) / self._rate_hz))
            self._parts, self._start = [rest.copy()], end
        return done
