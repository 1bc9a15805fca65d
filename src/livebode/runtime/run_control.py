"""RunControl: requests to a run from other threads."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from livebode.configuration import RecordSection
from livebode.core import Event

if TYPE_CHECKING:
    from livebode.sources.live import Health, LiveSource

EVENTS_MAX = 64


class StoppedError(Exception):
    """A recording was stopped before its end."""


class RunControl:
    """Requests a run to end, to continue with another configuration, or to record an event. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._messages: list[tuple[str, str, dict[str, Any]]] = []
        self._next: Any = None  # an Estimate, whose documents name this class
        self._record_section: RecordSection | None = None
        self._source: LiveSource | None = None
        self.ended = False
        """Whether its end was requested."""
        self.looked_s: float | None = None
        """When the run looked for samples last, by the monotonic clock; None while it does not wait for any."""
        self.stopped: Callable[[], Event | None] | None = None
        """Message if the run is stopped in its present state; None while there is no run."""

    def controls(self, source: LiveSource) -> None:
        """Set the source of the run, which is not open yet."""
        with self._lock:
            self._source = source
            if self.ended:
                source.stop()

    def end(self) -> None:
        """Request the end; received samples are recorded. May be called from a signal handler's thread."""
        self.ended = True
        source = self._source
        if source is not None:
            source.stop()

    def report(self, kind: str, message: str, **details: Any) -> None:
        """Record an event at the present sample of the run."""
        with self._lock:
            self._messages.append((kind, message, details))

    def record(self, event: Event) -> bool:
        """Record an event with its own sample and time; False if too many wait."""
        with self._lock:
            taken = len(self._events) < EVENTS_MAX
            if taken:
                self._events.append(event)
        return taken

    def limit_record(self, section: RecordSection) -> None:
        """Use other settings of the record from now."""
        with self._lock:
            self._record_section = section

    def change(self, estimate: Any, event: Event) -> None:
        """Finish the run after the present Block, with this event at its end, and continue in another one.

        The newest request is used.
        """
        with self._lock:  # at once: a Block between the two would follow the event
            self._messages.append((event.kind, event.message, dict(event.details)))
            self._next = estimate

    @property
    def changing(self) -> bool:
        """Whether there is an estimate to continue with."""
        return self._next is not None

    @property
    def source(self) -> LiveSource | None:
        """Live source of the samples, as soon as it is open."""
        source = self._source
        return source if source is not None and source.channels else None

    @property
    def health(self) -> Health | None:
        """State of the live source; None for a recording."""
        source = self.source
        return None if source is None else source.health

    def take_next(self) -> Any:
        """The estimate to continue with, once; None if there is none."""
        with self._lock:
            taken, self._next = self._next, None
        return taken

    def take_record_section(self) -> RecordSection | None:
        """The new settings of the record, once."""
        if self._record_section is None:
            return None
        with self._lock:
            taken, self._record_section = self._record_section, None
        return taken

    def take_recorded(self) -> list[Event]:
        """Events to be recorded since the last call."""
        if not self._events:
            return []
        with self._lock:
            taken, self._events = self._events, []
        return taken

    def take_reported(self, sample: int, time_s: float) -> list[Event]:
        """Reports since the last call, as events at the present sample and time."""
        if not self._messages:
            return []
        with self._lock:
            taken, self._messages = self._messages, []
        return [Event(kind, sample, time_s, message, details) for kind, message, details in taken]
