"""Checks of a Tracker's input: starts, gaps, and excluded samples."""

from __future__ import annotations

import numpy as np

from livebode.core import Block, Event, SignalError, Stage
from livebode.estimation.spectra import SpectraRows
from livebode.estimation.stream_estimator import StreamCounters
from livebode.language import Message

_KINDS = {
    "non-finite": Message("a sample is not finite"),
    "implausible": Message("a sample is more than 1e8 times larger than all in the period before"),
    "spike": Message("a sample differs strongly from the previous periods and is excluded"),
}


class InputStatistics(StreamCounters):
    """Counts and Events of a stream of Blocks."""

    _stage = Stage("sample-counts", 1)

    def __init__(self, events: list[Event], window: int) -> None:
        super().__init__(events, _KINDS, -window)
        self._window = window

    def starts(self, block: Block) -> bool:
        """Whether this block does not follow the previous samples; adds an Event where samples are missing."""
        first = self._next < 0
        missing = 0 if first else block.start - self._next
        if missing < 0:
            raise SignalError(
                "repeated",
                f"samples {block.start} to {self._next - 1} came twice",
                "let blocks follow each other: drop what repeats",
                first_sample=block.start,
                last_sample=self._next - 1,
            )
        gap = not first and (missing > 0 or block.gap)
        self._next = block.stop
        self.counts["samples"] += len(block)
        if gap:
            self.counts["gaps"] += 1
            self.counts["missing"] += missing
            message = Message(
                "an unknown number of samples is missing before sample {at_sample}", at_sample=block.start
            )
            if missing:
                message = Message(
                    "{missing_samples} samples are missing before sample {at_sample}",
                    missing_samples=missing,
                    at_sample=block.start,
                )
            self._exclude("gap", block, block.start, message, missing_samples=missing)
        return first or gap

    def count(self, block: Block, rows: SpectraRows) -> None:
        """Count the excluded samples; one Event for all that are within a window of each other."""
        excluded = {"non-finite": rows.not_finite, "implausible": rows.implausible, "spike": rows.spikes}
        new: list[tuple[int, str]] = []
        for kind, position in excluded.items():
            if not position.size:
                continue
            self.counts[kind] += position.size
            number = block.start + position
            apart = np.diff(number, prepend=self._last[kind]) >= self._window
            self._last[kind] = int(number[-1])
            new += [(int(sample), kind) for sample in number[apart]]
        for sample, kind in sorted(new):
            self._exclude(kind, block, sample, _KINDS[kind])

    def _exclude(self, kind: str, block: Block, sample: int, cause: str, **details: int) -> None:
        message = Message(
            "{what}; responses are invalid until a window of {window} samples is complete again",
            what=cause,
            window=self._window,
        )
        self._report(kind, block, sample, message, **details)
