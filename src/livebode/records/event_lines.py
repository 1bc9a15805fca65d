"""Read events.jsonl: line by line, each checked; a damaged line is reported in its place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from livebode.core import Event
from livebode.records.inside import open_read
from livebode.records.segments.damage import KIND
from livebode.records.segments.json_lines import in_line

NAME = "events.jsonl"
_LINE_BYTES_MAX = 1 << 20


def events(run: Path, report: Callable[[Event], None], *, finished: bool) -> Iterator[Event]:
    """The events of a run in order; a damaged line becomes an event of kind "record-damaged", which is also reported.

    A last line without an end is still being written, except if the run is finished.

    Raises
    ------
    RecordError, OSError
        If the file cannot be read.
    """
    sample, time_s, number = 0, 0.0, 0
    with open_read(run, NAME) as file:
        while line := file.readline(_LINE_BYTES_MAX):
            number += 1
            whole = line.endswith(b"\n")
            if not whole and len(line) == _LINE_BYTES_MAX:
                _skip_line(file)
                pieces: list[Any] = [line]
            else:
                pieces = list(in_line(line))
            for value in pieces:
                event = to_event(value)
                if event is None and not whole and not finished and len(line) < _LINE_BYTES_MAX:
                    return
                if event is None:
                    message = f"line {number} of {NAME} is damaged: {_bytes(value)} are not read"
                    event = Event(KIND, sample, time_s, message, {"file": NAME, "line": number})
                    report(event)
                sample, time_s = event.sample, event.time_s
                yield event


def to_event(value: Any) -> Event | None:
    """The event in this plain data; None if a run cannot have written it."""
    if not isinstance(value, dict):
        return None
    try:
        event = Event(**value | {"time_s": math.nan if value["time_s"] is None else value["time_s"]})  # JSON has no NaN
    except (TypeError, KeyError):
        return None
    texts = isinstance(event.kind, str) and isinstance(event.message, str) and isinstance(event.details, dict)
    numbers = type(event.sample) is int and type(event.time_s) in (int, float)
    return event if texts and numbers else None


def _bytes(value: dict[str, Any] | bytes) -> str:
    return f"{len(value)} bytes" if isinstance(value, bytes) else "its values"


def _skip_line(file: Any) -> None:
    while (rest := file.readline(_LINE_BYTES_MAX)) and not rest.endswith(b"\n"):
        pass
