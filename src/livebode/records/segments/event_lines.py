"""Read events.jsonl: line by line, each checked; a damaged line is reported in its place."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from livebode.core import Event
from livebode.language import Message
from livebode.records.inside import open_read
from livebode.records.segments.damage import KIND
from livebode.records.segments.json_lines import EVENTS, in_line

_LINE_BYTES_MAX = 1 << 20


def events(run: Path, report: Callable[[Event], None], *, finished: bool, least_bytes: int) -> Iterator[Event]:
    """The events of a run in order; a damaged line becomes an event of kind "record-damaged", which is also reported.

    The file had `least_bytes` at the newest commit. A last line without an end behind them is still being written,
    except if the run is finished.

    Raises
    ------
    RecordError, OSError
        If the file cannot be read.
    """
    sample, time_s, number, length = 0, 0.0, 0, 0
    with open_read(run, EVENTS) as file:
        while line := file.readline(_LINE_BYTES_MAX):
            number, start, length = number + 1, length, length + len(line)
            whole = line.endswith(b"\n")
            if not whole and len(line) == _LINE_BYTES_MAX:
                length += _skip_line(file)
                pieces: list[Any] = [line]
            else:
                pieces = list(in_line(line))
            unwritten = not whole and not finished and len(line) < _LINE_BYTES_MAX and start >= least_bytes
            for value in pieces:
                event = to_event(value)
                if event is None and unwritten:
                    return
                if event is None:
                    message = Message(
                        "line {line} of {file} is damaged: {what} are not read",
                        line=number,
                        file=EVENTS,
                        what=_bytes(value),
                    )
                    event = Event(KIND, sample, time_s, message)
                    report(event)
                sample, time_s = event.sample, event.time_s
                yield event
    if length < least_bytes:
        event = end_missing(least_bytes - length, sample, time_s)
        report(event)
        yield event


def end_missing(lost_bytes: int, sample: int, time_s: float) -> Event:
    """The damage of a file that is shorter than it was."""
    message = Message(
        "{file} is damaged: its last {missing_bytes} bytes, the newest events, are missing",
        file=EVENTS,
        missing_bytes=lost_bytes,
    )
    return Event(KIND, sample, time_s, message)


def ends_line(run: Path) -> bool:
    """Whether the last byte is the end of a line."""
    with open_read(run, EVENTS) as file:
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n"


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
    return Message("{size} bytes", size=len(value)) if isinstance(value, bytes) else Message("its values")


def _skip_line(file: Any) -> int:
    """Read to the end of the line; the number of bytes."""
    length = 0
    while rest := file.readline(_LINE_BYTES_MAX):
        length += len(rest)
        if rest.endswith(b"\n"):
            break
    return length
