"""Dropped: the span of samples that a full queue rejects, reported at its beginning and at its end."""

from __future__ import annotations

from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch


class Dropped:
    """Counts the samples dropped until the queue accepts a batch again; numbers are the sender's."""

    def __init__(self, source_events: SourceEvents) -> None:
        self._events = source_events
        self._samples = self._first = self._last = 0

    def take(self, batch: AnyBatch) -> None:
        """This batch is dropped."""
        if not self._samples:
            self._first = batch.first_sample
            self._events.report(
                "overflow",
                f"the queue is full; samples from the sender's number {batch.first_sample} are dropped until a quarter "
                "of it is free; use a longer tracking.hop, fewer lines or fewer axes on this computer",
                sender_first=batch.first_sample,
            )
        self._samples += batch.samples
        self._last = batch.stop - 1

    def finish(self) -> None:
        """The queue accepts batches again, or the source ended."""
        if self._samples:
            self._events.report(
                "overflow",
                f"the queue was full: the sender's samples {self._first} … {self._last} ({self._samples}) were dropped",
                samples=self._samples,
                sender_first=self._first,
                sender_last=self._last,
            )
        self._samples = 0
