"""Status of an axis, for other threads."""

from __future__ import annotations

import time
from pathlib import Path

from livebode.core import Block, Event, MatrixResponses, Responses
from livebode.runtime.documents import Channels, Document, RunStarted, TrackerResults
from livebode.runtime.run_control import RunControl
from livebode.sources.live import Health, LiveBlock

_LATENCY_OVER_S = 2.0


class Status:
    """A subscriber that keeps the data for a status line of the axis.

    Attributes
    ----------
    state
        "waiting", "tracking", "finishing", "done", "refused", or "ended" before there was anything to record.
    directory
        Directory of its newest run.
    samples, responses
        Number of tracked samples and published responses.
    rate_hz
        Samples per second of the run; None before it began.
    event
        The newest event.
    """

    def __init__(self) -> None:
        self.state = "waiting"
        self.directory: Path | None = None
        self.samples = self.responses = 0
        self.rate_hz: float | None = None
        self.event: Event | None = None
        self._control: RunControl | None = None
        self._since_s = 0.0
        self._latest: tuple[float, float] = (0.0, 0.0)

    @property
    def health(self) -> Health | None:
        """State of its live source; None for a recording, or before the run began."""
        return None if self._control is None else self._control.health

    @property
    def latency_s(self) -> float | None:
        """Longest time, in the last seconds, from a Block's arrival until all its results were published."""
        longest = max(self._latest)
        return longest if longest > 0 else None

    def __call__(self, document: Document) -> None:
        match document:
            case RunStarted():
                self.state, self.directory, self._control = "tracking", document.directory, document.control
            case Channels():
                self.rate_hz = document.rate_hz
            case Responses() | MatrixResponses():
                self.responses += len(document)
            case Event():
                self.event = document
            case TrackerResults(block):
                self._followed(block)

    def _followed(self, block: Block) -> None:
        self.samples += len(block)
        if isinstance(block, LiveBlock):
            now = time.monotonic()
            if now - self._since_s > _LATENCY_OVER_S:
                self._since_s, self._latest = now, (0.0, self._latest[0])
            self._latest = (max(self._latest[0], now - block.arrived_s), self._latest[1])
