"""events.jsonl: what a person should know, appended and never removed."""

from __future__ import annotations

import logging
from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.core import Event
from livebode.records.segments.disk import AppendFile
from livebode.records.segments.json_lines import to_line

_HELD_MAX = 100_000
_EXPECTED = {"record-continued", "record-closed", "record-removed"}
_logger = logging.getLogger(__name__)


class EventLog:
    """Events that wait for the disk, and those that the record itself has to say; these are logged, too.

    Parameters
    ----------
    run
        The directory of the run.
    """

    def __init__(self, run: Path) -> None:
        self._run = run
        self._waiting: list[bytes] = []
        self._said: list[Event] = []
        self._given_up = 0

    def add(self, event: Event) -> None:
        """Append it with the next `write`; beyond 100,000 that wait, events are only counted."""
        if len(self._waiting) < _HELD_MAX:
            self._waiting.append(to_line(asdict(event)))
        else:
            self._given_up += 1

    def say(self, kind: str, sample: int, time_s: float, message: str, **details: Any) -> Event:
        """Append an event of the record itself, and keep it for `drain`."""
        return self.say_event(Event(kind, sample, time_s, message, details))

    def say_event(self, event: Event) -> Event:
        """The same with an event that is there already."""
        level = logging.INFO if event.kind in _EXPECTED else logging.WARNING
        _logger.log(level, "%s: %s", self._run, event.message)
        self._said.append(event)
        self.add(event)
        return event

    def drain(self) -> list[Event]:
        """What the record itself has said since the last call."""
        said, self._said = self._said, []
        return said

    def take_given_up(self) -> int:
        given_up, self._given_up = self._given_up, 0
        return given_up

    def write(self, file: AppendFile) -> None:
        """Append what waits, or raise OSError and let it wait."""
        if self._waiting:
            file.append_synced(b"".join(self._waiting))
            self._waiting.clear()
