"""`follow_recording`: the run loop on a recording, for whoever takes the results and writes no run directory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from livebode.configuration import Axis
from livebode.core import Event, Responses
from livebode.estimation import Follower
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.documents import Document
from livebode.runtime.feed import Feed
from livebode.runtime.recorder import Destination, RecordInOnePiece
from livebode.runtime.recording import examined_recording
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import RunLoop
from livebode.sources import Log


class RecordInMemory(RecordInOnePiece):
    """Hands the responses of a run to a function, and retains its events.

    Parameters
    ----------
    take
        Called with each batch of responses.
    """

    path = Path()

    def __init__(self, take: Callable[[Responses], None]) -> None:
        self._take, self.events = take, list[Event]()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None: ...

    def take(self, document: Document) -> None:
        if isinstance(document, Event):
            self.events.append(document)
        elif isinstance(document, Responses):
            self._take(document)

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None: ...


def _draw_nothing(*_: Any) -> None: ...


def follow_recording(axis: Axis, log: Log, follower: Follower, take: Callable[[Responses], None]) -> list[Event]:
    """Track an open recording as `run` does, `take` each batch of its responses, and return the events of the run.

    Raises
    ------
    LivebodeError
        As `run`.
    """
    keep_freed_memory()
    record = RecordInMemory(take)
    to = Destination(record.path, _draw_nothing, record=record)
    of = examined_recording(axis, log, follower, to)
    feed = Feed(of.source, RunControl(), noticed=of.noticed)
    RunLoop(feed, of.estimate, to, about={"found": of.found}).run()
    return record.events
