"""Orders: what a run is told from outside while it goes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from livebode.core import Event
from livebode.session.axis import RecordSection
from livebode.session.pipeline import Pipeline
from livebode.sources.live import LiveSource


class StoppedError(Exception):
    """Somebody ended a recording before its end."""


class Orders:
    """Tells one run to end, to go on otherwise, or to record what happened to it. Any thread may tell."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._said: list[tuple[str, str, dict[str, Any]]] = []
        self._next: Pipeline | None = None
        self._kept: RecordSection | None = None
        self._source: LiveSource | None = None
        self.ended = False
        """Whether it was told to end."""
        self.left: Callable[[], Event] | None = None
        """What is to be said of the run if it is left as it is now; None while there is none to be left."""

    def of(self, source: LiveSource) -> None:
        """The run takes its samples from this one, which is not open yet."""
        with self._lock:
            self._source = source
            if self.ended:
                source.stop()

    def end(self) -> None:
        """End whole, with what has come. May be called from a signal handler's thread while nothing else is told."""
        self.ended = True
        source = self._source
        if source is not None:
            source.stop()

    def say(self, kind: str, message: str, **details: Any) -> None:
        """Record an event at the sample where the run is."""
        with self._lock:
            self._said.append((kind, message, details))

    def keep(self, kept: RecordSection) -> None:
        """Cut the record otherwise from here on."""
        with self._lock:
            self._kept = kept

    def change(self, pipeline: Pipeline) -> None:
        """Finish the run at the next Block, and go on in another one; of several the newest counts."""
        with self._lock:
            self._next = pipeline

    def changing(self) -> bool:
        """Whether there is something to go on with."""
        return self._next is not None

    @property
    def source(self) -> LiveSource | None:
        """Where the samples come from, once it is open."""
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
        """What was said since the last call, as events of this moment."""
        with self._lock:
            said, self._said = self._said, []
        return [Event(kind, sample, time_s, message, details) for kind, message, details in said]
