"""Dropped: the span of samples that a full queue rejects, reported at its beginning and at its end."""

from __future__ import annotations

from livebode.language import Message
from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch


class Dropped:
    """Counts the samples dropped until the queue accepts a batch again; numbers are the sender's."""

    def __init__(self, source_events: SourceEvents) -> None:
        self._events = source_events
        self._samples = self._first = self._last = 0

    def take(self, batch: AnyBatch, advice: str) -> None:
        """This batch is dropped; `advice` against it."""
        if not self._samples:
            self._first = batch.first_sample
            self._events.report(
                "overflow",
                Message(
                    "the queue is full; samples from the sender's number {sender_first} are dropped until a quarter of "
                    "it is free; {advice}",
                    sender_first=batch.first_sample,
                    advice=advice,
                ),
            )
        self._samples += batch.samples
        self._last = batch.stop - 1

    def finish(self) -> None:
        """The queue accepts batches again, or the source ended."""
        if self._samples:
            self._events.report(
                "overflow",
                Message(
                    "the queue was full: the sender's samples {sender_first} … {sender_last} ({samples}) were dropped",
                    sender_first=self._first,
                    sender_last=self._last,
                    samples=self._samples,
                ),
            )
        self._samples = 0
