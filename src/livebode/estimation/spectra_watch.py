"""Checks of a SpectraTracker's input: missing spectra, and windows that the drive marks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event, SignalError, Spectra, Stage
from livebode.estimation.stream_counters import StreamCounters
from livebode.language import Message

DRIVE = {
    "not-whole": Message("a window is incomplete (marked by the drive, or its sums are not finite)"),
    "implausible": Message("a spectrum is more than 1e8 times larger than all in the period before"),
    "spike": Message("the drive marks a window with a spike"),
}


class SpectraInputStatistics(StreamCounters):
    """Counts and Events of a stream of Spectra. One Event for marked windows that overlap or follow each other."""

    _stage = Stage("spectra-counts", 1)

    def __init__(self, events: list[Event], window: int, sentences: Mapping[str, str] = DRIVE) -> None:
        super().__init__(events, sentences, -(1 << 62), also=("spectra",))
        self._window, self._sentences = window, sentences

    def take(self, block: Spectra, marked: dict[str, NDArray[np.bool_]]) -> None:
        """Count these, of each kind those that are `marked`; SignalError where they overlap the previous ones."""
        first = self._next < 0
        missing = 0 if first else block.start - self._next
        if missing < 0:
            raise SignalError(
                "repeated",
                f"spectra up to sample {self._next - 1} came twice, from sample {block.start} on",
                "let blocks follow each other: drop what repeats",
                first_sample=block.start,
                last_sample=self._next - 1,
            )
        if not first and (missing or block.gap):
            self.counts["gaps"] += 1
            self.counts["missing"] += missing
            message = Message(
                "an unknown number of spectra is missing before sample {at_sample}", at_sample=block.start
            )
            if missing:
                message = Message(
                    "spectra of {missing_samples} samples are missing before sample {at_sample}",
                    missing_samples=missing,
                    at_sample=block.start,
                )
            self._report("gap", block, block.start, message, missing_samples=missing)
        if first:
            # A stream that begins with the drive is incomplete at first, which needs no event.
            self._last["not-whole"] = int(block.sample[0]) - block.layout.hop
        self._count(block, marked["not-whole"], block.layout.hop + missing)
        self._next = block.stop
        begins: list[tuple[int, str]] = []
        for kind, those in marked.items():
            if those.any():
                sample = block.sample[those]
                apart = np.diff(sample, prepend=self._last[kind]) >= max(self._window, block.layout.hop + 1)
                begins += [(int(n), kind) for n in sample[apart]]
                self.counts[kind] += sample.size
                self._last[kind] = int(sample[-1])
        for number, kind in sorted(begins):
            self._report(kind, block, number, Message("{what}; its response is not valid", what=self._sentences[kind]))

    def continues_at(self, start: int) -> bool:
        """Whether this is the sample after the previous spectra."""
        return self._next == start

    def take_whole(self, hop: int) -> None:
        """Count a spectrum that is whole and follows the previous one, as `take` would."""
        self._next += hop
        self.counts["samples"] += min(hop, self._window)
        self.counts["spectra"] += 1

    def _count(self, block: Spectra, not_whole: NDArray[np.bool_], new: int) -> None:
        """Samples of these windows that previous ones did not contain; `new` since the previous window."""
        if self._next < 0 and not not_whole[0]:
            new = self._window
        self.counts["samples"] += min(new, self._window) + (len(block) - 1) * min(block.layout.hop, self._window)
        self.counts["spectra"] += len(block)
