"""A live run in this process on a peer that a test drives, and what holds it up."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import numpy as np

from livebode.cli.notices import NoticePrinter
from livebode.configuration import Axis
from livebode.core import Event
from livebode.records import RunRecord
from livebode.runtime import Destination, Document, RunControl, Subscriber, TrackerResults, run
from livebode.sources.live import Batch, SourceSettings
from tests.support.peers.peer import CHANNELS, RATE_HZ, Peer

SIZE = 2000
"""Samples in a batch of a sender in a hurry: half a second."""


def hurried(count: int, first: int) -> list[Batch]:
    """Batches of half a second, numbered in their first channel."""
    found = []
    for start in range(first, first + count * SIZE, SIZE):
        data = np.stack([np.arange(start, start + SIZE, dtype=float), np.sin(0.1 * np.arange(SIZE))])
        found.append(Batch(start, data, CHANNELS, RATE_HZ, 0))
    return found


class Stuck:
    """Holds up the thread that tracks, as a slow computer does; or another function, as a slow disk does."""

    def __init__(self) -> None:
        self.held, self.released = threading.Event(), threading.Event()

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults):
            self.held.set()
            self.released.wait()

    def before(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, which does nothing before it is released."""

        def held(*arguments: Any) -> Any:
            self.held.set()
            self.released.wait()
            return function(*arguments)

        return held


class LiveSession:
    """`run` in a thread, on a peer that is open; leaving it ends the run and waits for its record.

    `sections` are those of the axis; w is the input and y the output by the direct estimator where not given.
    """

    def __init__(self, folder: Path, peer: Peer, *subscribers: Subscriber, **sections: Any) -> None:
        settings: dict[str, Any] = {
            "source": SourceSettings(**peer.settings).model_dump(exclude_unset=True),
            "signals": {"output": "y", "input": "w"},
            "lines": {"frequencies": "100", "window": 400},
            "tracking": {"estimator": "direct"},
        }
        self.run, self.control = folder / "run", RunControl()
        self.shown: list[str] = []
        subscribers = (*subscribers, NoticePrinter(self.shown.append))
        to = Destination(self.run, lambda *_: None, subscribers=subscribers)
        self._arguments = Axis.of(settings | sections, "test"), to, self.control
        self._error: BaseException | None = None

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._work)
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.control.end()
        self._thread.join()
        if kind is None and self._error is not None:
            raise self._error

    def events(self) -> list[Event]:
        """What is in the record now."""
        begun = (self.run / "run.json").exists() and (self.run / "events.jsonl").exists()
        return RunRecord.open(self.run).events() if begun else []

    def _work(self) -> None:
        try:
            run(*self._arguments)
        except BaseException as error:
            self._error = error
