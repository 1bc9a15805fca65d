"""Orders: requests to a run from outside."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from livebode.configuration.axis import RecordSection
from livebode.core import Event
from livebode.runtime.pipeline import Pipeline
from livebode.sources.live import LiveSource


class StoppedError(Exception):
    """A recording was stopped before its end."""


class Orders:
    """Requests a run to end, to continue with another configuration, or to record an event. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._said: list[tuple[str, str, dict[str, Any]]] = []
        self._next: Pipeline | None = None
        self._kept: RecordSection | None = None
        self._source: LiveSource | None = None
        self.ended = False
        """Whether its end was requested."""
        self.left: Callable[[], Event] | None = None
        """Message if the run is stopped in its present state; None while there is no run."""

    def of(self, source: LiveSource) -> None:
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

    def say(self, kind: str, message: str, **details: Any) -> None:
        """Record an event at the present sample of the run."""
        with self._lock:
            self._said.append((kind, message, details))

    def keep(self, kept: RecordSection) -> None:
        """Use other record settings from now."""
        with self._lock:
            self._kept = kept

    def change(self, pipeline: Pipeline) -> None:
        """Finish the run at the next Block, and continue in another one; the newest request is used."""
        with self._lock:
            self._next = pipeline

    def changing(self) -> bool:
        """Whether there is a pipeline to continue with."""
        return self._next is not None

    @property
    def source(self) -> LiveSource | None:
        """Source of the samples, as soon as it is open."""
        source = self._source
        return source if source is not None and source.channels else None

    def take_next(self) -> Pipeline | None:
        with self._lock:
            taken, self._next = self._next, None
        return taken

    def take_kept(self) -> RecordSection | None:
        with self._lock:
            taken, self._kept = self._kept, None
        return taken

    def drain_events(self, sample: int, time_s: float) -> list[Event]:
        """Requested events since the last call, at the present time."""
        with self._lock:
            said, self._said = self._said, []
        return [Event(kind, sample, time_s, message, details) for kind, message, details in said]
