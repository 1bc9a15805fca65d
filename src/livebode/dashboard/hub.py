"""Hub: the mailbox between the thread that tracks and the dashboard."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from livebode.analysis.overview import Overview
from livebode.core import Block, Event, Parameters, Responses
from livebode.runtime import Audience
from livebode.sources.live import Health, LiveBlock

Item = Responses | tuple[Parameters, ...] | Event

VALUES_MAX = 1 << 20
"""Largest number of values (responses × lines) that wait for the dashboard, about 40 MB; older ones are dropped."""
EVENTS_MAX = 4096
_SAYINGS_MAX = 64
_DELAYS = 1024
_INTERVALS = 16


class Hub(Audience):
    """Buffers the data that an axis publishes until the dashboard takes them at its own rate.

    Every method of an Audience only appends to a list, under a lock that is held no longer than that. Data that the
    dashboard does not take in time are dropped, oldest first, so that memory is bounded.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.directory: Path | None = None
        self.begun: Mapping[str, Any] | None = None
        self.ended: Mapping[str, Any] | None = None
        self.health: Callable[[], Health] | None = None
        self.overview: Overview | None = None
        self.samples = self.gaps = self.given_up = 0
        self.intervals_s: deque[float] = deque(maxlen=_INTERVALS)
        self.followed_s = 0.0
        """`time.monotonic()` of the newest samples, or of the start of the run."""
        self.clock: Sequence[tuple[float, float]] = ()
        """Time of day of the run's seconds, as in `RunClock`."""
        self.delays_s: deque[float] = deque(maxlen=_DELAYS)
        self._lock = threading.Lock()
        self._rows: deque[Responses | tuple[Parameters, ...]] = deque()
        self._values = 0
        self._events: deque[Event] = deque(maxlen=EVENTS_MAX)
        self._sayings: list[Event] = []

    def share(self, overview: Overview) -> None:
        self.overview = overview

    def begin(self, directory: Path, summary: Mapping[str, Any], health: Callable[[], Health] | None) -> None:
        with self._lock:  # buffered data belong to a previous run, whose lines may differ
            self._rows, self._values = deque(), 0
        self.directory, self.health, self.ended = directory, health, None
        self.followed_s, self.clock = time.monotonic(), ()
        self.intervals_s.clear()
        self.begun = summary

    def set_clock(self, pieces: Sequence[tuple[float, float]]) -> None:
        self.clock = tuple(pieces)

    def write(self, responses: Responses) -> None:
        self._keep(responses, responses.value.size)

    def write_parameters(self, *parts: Parameters) -> None:
        self._keep(parts, sum(part.value.size for part in parts))

    def write_event(self, event: Event) -> None:
        with self._lock:
            self._events.append(event)

    def drain_events(self) -> list[Event]:
        if not self._sayings:
            return []
        with self._lock:
            sayings, self._sayings = self._sayings, []
        return sayings

    def followed(self, block: Block) -> None:
        self.samples = block.stop
        self.gaps += block.gap
        if not len(block):
            return
        now_s = time.monotonic()
        self.intervals_s.append(now_s - self.followed_s)
        self.followed_s = now_s
        if isinstance(block, LiveBlock):
            self.delays_s.append(self.followed_s - block.arrived_s)

    def finish(self, summary: Mapping[str, Any]) -> None:
        self.ended = summary

    def say(self, event: Event) -> bool:
        """Record an event; False if the run has ended or too many are waiting."""
        with self._lock:
            taken = self.ended is None and len(self._sayings) < _SAYINGS_MAX
            if taken:
                self._sayings.append(event)
        return taken

    def take(self) -> list[Item]:
        """Data since the last call, events last."""
        with self._lock:
            rows, self._rows, self._values = self._rows, deque(), 0
            events, self._events = self._events, deque(maxlen=EVENTS_MAX)
        return [*rows, *events]

    def _keep(self, item: Responses | tuple[Parameters, ...], values: int) -> None:
        with self._lock:
            self._rows.append(item)
            self._values += values
            while self._values > VALUES_MAX and len(self._rows) > 1:
                old = self._rows.popleft()
                self._values -= _size(old)
                self.given_up += 1


def _size(item: Responses | tuple[Parameters, ...]) -> int:
    return item.value.size if isinstance(item, Responses) else sum(part.value.size for part in item)
