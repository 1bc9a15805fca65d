"""events.jsonl: events for people, appended and never removed."""

from __future__ import annotations

import logging
from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.core import Emit, Event
from livebode.records.segments.disk import AppendFile
from livebode.records.segments.json_lines import to_line

_HELD_MAX = 100_000
_EXPECTED = {"record-continued", "record-closed", "record-removed"}
_logger = logging.getLogger(__name__)


class EventLog:
    """Events that wait for the disk, and events of the record itself, which are also logged.

    Parameters
    ----------
    run
        The directory of the run.
    emit
        Receives the events of the record itself.
    """

    def __init__(self, run: Path, emit: Emit) -> None:
        self._run, self._emit = run, emit
        self._waiting: list[bytes] = []
        self._given_up = 0

    def add(self, event: Event) -> None:
        """Append it with the next `write`; above 100,000 waiting events, more are only counted."""
        if len(self._waiting) < _HELD_MAX:
            self._waiting.append(to_line(asdict(event)))
        else:
            self._given_up += 1

    def report(self, kind: str, sample: int, time_s: float, message: str, **details: Any) -> Event:
        """Append an event of the record itself, and emit it."""
        return self.report_event(Event(kind, sample, time_s, message, details))

    def report_event(self, event: Event) -> Event:
        """The same with an existing event."""
        level = logging.INFO if event.kind in _EXPECTED else logging.WARNING
        _logger.log(level, "%s: %s", self._run, event.message)
        self.add(event)
        self._emit(event)
        return event

    def drain_given_up(self) -> int:
        given_up, self._given_up = self._given_up, 0
        return given_up

    def write(self, file: AppendFile) -> None:
        """Append waiting events, or raise OSError; they then still wait."""
        if self._waiting:
            file.append_synced(b"".join(self._waiting))
            self._waiting.clear()
