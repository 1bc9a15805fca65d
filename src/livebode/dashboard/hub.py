"""Hub: the mailbox between the thread that tracks and the dashboard."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from livebode.analysis import Overview
from livebode.core import Block, Event, Parameters, Responses
from livebode.dashboard.signal_tap import SignalTap
from livebode.runtime import (
    Channels,
    ClockSet,
    Document,
    FitResults,
    RunControl,
    RunEnded,
    RunStarted,
    RunStep,
    TrackerResults,
)
from livebode.sources.live import Health, LiveBlock

Item = Responses | tuple[Parameters, ...] | Event

VALUES_MAX = 1 << 20
"""Largest number of values (responses × lines) that wait for the dashboard, about 40 MB; older ones are dropped."""
ITEMS_MAX = 2048
"""Largest number of batches that wait: one of a single response takes several kB, whatever its number of lines."""
EVENTS_MAX = 4096
_DELAYS = 1024
_INTERVALS = 16


class Hub:
    """A subscriber that buffers the data that an axis publishes until the dashboard takes them at its own rate.

    A document is only appended to a list, under a lock that is held no longer than that. Data that the dashboard does
    not take in time are dropped, oldest first, so that memory is bounded.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.directory: Path | None = None
        self.begun: Mapping[str, Any] | None = None
        self.ended: Mapping[str, Any] | None = None
        self.overview: Overview | None = None
        self.samples = self.gaps = self.given_up = 0
        self._complete = False
        self.intervals_s: deque[float] = deque(maxlen=_INTERVALS)
        self.followed_s = 0.0
        """`time.monotonic()` of the newest samples, or of the start of the run."""
        self.clock: Sequence[tuple[float, float]] = ()
        """Time of day of the run's seconds, as in `RunClock`."""
        self.delays_s: deque[float] = deque(maxlen=_DELAYS)
        self.signals = SignalTap()
        self._lock = threading.Lock()  # the tracking thread appends, the server's thread drains
        self._rows: deque[Responses | tuple[Parameters, ...]] = deque()
        self._values = 0
        self._events: deque[Event] = deque(maxlen=EVENTS_MAX)
        self.control: RunControl | None = None

    @property
    def health(self) -> Health | None:
        """State of the live source; None for a recording, or before the run."""
        return None if self.control is None else self.control.health

    def __call__(self, document: Document) -> None:
        match document:
            case Responses():
                self._append(document, document.value.size)
            case FitResults(parts):
                self._append(parts, sum(part.value.size for part in parts))
            case Event():
                with self._lock:
                    self._events.append(document)
            case TrackerResults(block):
                self._count(block)
            case RunStarted():
                self._begin(document)
            case Channels(used):
                self.signals.begin(used, (self.begun or {}).get("found", {}).get("window", 0))
            case ClockSet(pieces):
                self.clock = pieces
            case RunStep("ending"):
                self._complete = True
            case RunEnded(summary):
                self.ended = summary

    @property
    def ending(self) -> bool:
        """Whether no more samples follow: the source is at its end, or a person ended the run; pictures are drawn."""
        return self._complete or (self.control is not None and self.control.ended)

    def record(self, event: Event) -> bool:
        """Record an event of a person; False if the run has ended or too many are waiting."""
        return self.ended is None and self.control is not None and self.control.record(event)

    def _begin(self, started: RunStarted) -> None:
        with self._lock:  # buffered data belong to a previous run, whose lines may differ
            self._rows, self._values = deque(), 0
        self.directory, self.control, self.overview = started.directory, started.control, started.overview
        self.ended = None
        self._complete = False
        self.followed_s, self.clock = time.monotonic(), ()
        self.intervals_s.clear()
        self.begun = started.summary

    def _count(self, block: Block) -> None:
        self.samples = block.stop
        self.gaps += block.gap
        if not len(block):
            return
        now_s = time.monotonic()
        self.intervals_s.append(now_s - self.followed_s)
        self.followed_s = now_s
        self.signals.add(block, now_s)
        if isinstance(block, LiveBlock):
            self.delays_s.append(self.followed_s - block.arrived_s)

    def drain(self) -> list[Item]:
        """Data since the last call, events last."""
        with self._lock:
            rows, self._rows, self._values = self._rows, deque(), 0
            events, self._events = self._events, deque(maxlen=EVENTS_MAX)
        return [*rows, *events]

    def _append(self, item: Responses | tuple[Parameters, ...], values: int) -> None:
        with self._lock:
            self._rows.append(item)
            self._values += values
            while (self._values > VALUES_MAX or len(self._rows) > ITEMS_MAX) and len(self._rows) > 1:
                old = self._rows.popleft()
                self._values -= _size(old)
                self.given_up += 1


def _size(item: Responses | tuple[Parameters, ...]) -> int:
    return item.value.size if isinstance(item, Responses) else sum(part.value.size for part in item)
