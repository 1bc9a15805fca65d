"""A run read back: what its directory holds, as the objects that were written."""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from livebode.arrow import to_numpy
from livebode.core import PER_LINE, PER_RESPONSE, DamageWarning, Event, Lines, LivebodeError, RecordError, Responses
from livebode.records import event_lines
from livebode.records.grouped_events import still_waiting
from livebode.records.piece import Piece
from livebode.records.response_table import ADDED, SCHEMA
from livebode.records.segments import reading
from livebode.records.segments.damage import KIND
from livebode.records.segments.manifest import Manifest, Segment
from livebode.records.summary_file import RUN, read_summary
from livebode.records.summary_shape import what_is_wrong

_logger = logging.getLogger(__name__)
_ROWS = 1 << 16  # of responses at once, times their lines: some 10 MB


@dataclass(frozen=True)
class Files:
    """Where the rows of a table are: Parquet files, of a single one perhaps only some row groups, and batches."""

    paths: list[Path]
    groups: list[int] | None
    rows: list[pa.RecordBatch]


def lines_in(found: Mapping[str, Any]) -> Lines:
    """The lines that run.json names under `found`."""
    return Lines(tuple(found["bins"]), found["window"], found["rate_hz"], tuple(found["quiet_bins"]))


@dataclass(frozen=True)
class Run:
    """The directory of a run: finished, stopped, killed, or still being written.

    What is read is what was committed when it is read; a run that is being written has more a moment later.

    Attributes
    ----------
    path
        Where it stands.
    summary
        run.json as it is.
    damages
        What was found damaged so far, as events of kind "record-damaged"; the rest is read.
    told
        Called with each of them, once; a `DamageWarning` by default.
    """

    path: Path
    summary: dict[str, Any]
    damages: list[Event] = field(default_factory=list, compare=False)
    told: Callable[[Event], None] | None = field(default=None, compare=False)

    @classmethod
    def open(cls, path: Path, told: Callable[[Event], None] | None = None) -> Run:
        """The run in this directory.

        Raises
        ------
        RecordError
            If no run wrote it, or run.json or the responses cannot be read.
        GridError
            If the lines in run.json cannot be a grid.
        """
        summary, damaged = read_summary(path)
        run = cls(path, summary, told=told)
        if wrong := what_is_wrong(summary):
            raise RecordError(
                "unexpected-content",
                f"{str(path / RUN)!r} is not what a run writes ({wrong})",
                "run the recording again",
                path=str(path / RUN),
                reason=wrong,
            )
        try:
            len(run.lines)
        except LivebodeError as error:
            raise error.at(str(path / RUN)) from None
        if damaged:
            run.tell(Event(KIND, 0, 0.0, damaged, {"file": RUN}))
        return run

    def tell(self, damage: Event) -> None:
        """Note what was found damaged."""
        if damage not in self.damages:
            self.damages.append(damage)
            _logger.warning("%s: %s", self.path, damage.message)
            if self.told is not None:
                self.told(damage)
                return
            warnings.warn(f"{self.path}: {damage.message}", DamageWarning, stacklevel=2)

    @property
    def found(self) -> dict[str, Any]:
        """What run.json says of rate, window, lines, quantity and unit."""
        return dict(self.summary["found"])

    @property
    def lines(self) -> Lines:
        """Where it was measured."""
        return lines_in(self.found)

    @property
    def finished(self) -> bool:
        """Whether its source came to its end and everything is written."""
        return bool(self.summary.get("record", {}).get("finished", True))

    def responses(self) -> Responses:
        """All responses, as they were written; none before the first."""
        return Responses.join(list(self.batches()) or [self._responses(SCHEMA.empty_table(), self.lines)])

    def batches(self, size_bytes_max: int | None = None) -> Iterator[Responses]:
        """All that can be read in order, in parts of bounded size; or the newest, from files of no more than this."""
        return self._in_parts(self.tables("responses", size_bytes_max))

    def steady_batches(self) -> Iterator[Responses]:
        """The same without those from a transient at the start of a live run; those that the run averaged are all."""
        left_out = int(self.summary.get("left_out_samples") or 0)
        averages = (self.summary.get("configuration", {}).get("tracking") or {}).get("average")
        for part in self.batches():
            yield part if averages or not left_out else part[np.flatnonzero(part.first >= left_out)]

    def between(self, from_s: float, to_s: float) -> Iterator[Responses]:
        """Those that speak for a span of time, ends included, in parts; segments outside of it are not read."""
        for part in self._in_parts(self.tables("responses", span_s=(from_s, to_s))):
            if len(within := part.between(from_s, to_s)):
                yield within

    def _in_parts(self, tables: Iterator[pa.Table]) -> Iterator[Responses]:
        lines = self.lines
        rest: pa.Table | None = None
        for part in tables:
            if part.schema.names not in (SCHEMA.names, [name for name in SCHEMA.names if name not in ADDED]):
                raise RecordError(
                    "unexpected-content",
                    f"the responses in {str(self.path)!r} have other columns than a run writes",
                    "run the recording again",
                    path=str(self.path),
                    columns=part.schema.names,
                )
            for start in range(0, part.num_rows, _ROWS):
                piece = part.slice(start, _ROWS)
                table = piece if rest is None else pa.concat_tables([rest, piece])
                whole = table.num_rows // len(lines) * len(lines)
                rest = table.slice(whole)
                if whole:
                    yield self._responses(table.slice(0, whole), lines)
        if rest is not None and rest.num_rows:
            raise RecordError(
                "unexpected-content",
                f"the record in {str(self.path)!r} ends within a response, which a run does not write",
                "run the recording again",
                path=str(self.path),
            )

    def tables(
        self, name: str, size_bytes_max: int | None = None, span_s: tuple[float, float] | None = None
    ) -> Iterator[pa.Table]:
        """The rows of "responses", "parameters" or "samples" in order, part by part; none where it was not recorded.

        With `span_s`, segments that lie wholly outside of that time are left out.

        Raises
        ------
        RecordError
            While iterating, if nothing can be read, or it holds what a run does not write. A part that is damaged is
            left out and noted in `damages`.
        """
        file = self.path / name
        try:
            if reading.in_segments(self.path):
                yield from reading.tables(self.path, name, self.tell, size_bytes_max, span_s, finished=self.finished)
            elif (piece := self._piece(name)) is not None:
                yield from (pa.Table.from_batches([batch]) for batch in piece.batches(_ROWS))
        except (OSError, pa.ArrowException, KeyError, TypeError) as error:
            raise _unreadable(file, error) from None

    def _piece(self, name: str) -> Piece | None:
        """A table that is in one file; None where it was not recorded, or the file is gone, which is reported."""
        file, parts = f"{name}.parquet", self.summary.get("files", {})
        if os.path.lexists(self.path / file):
            return Piece(self.path, file, parts.get(file), self.tell)
        if name == "responses" or file in parts:
            self.tell(Event(KIND, 0, 0.0, f"{file} is damaged: it is gone", {"file": file}))
        return None

    @property
    def segments(self) -> list[Segment]:
        """The closed segments that stand, by age; none where the run is not kept in segments."""
        return Manifest.read(self.path).segments if reading.in_segments(self.path) else []

    def files(self, tables: Collection[str]) -> dict[str, Files]:
        """Of these tables, those that were recorded: the Parquet files that are whole, and the rows in none yet."""
        try:
            if not reading.in_segments(self.path):
                groups = {name: piece.groups() for name in tables if (piece := self._piece(name)) is not None}
                whole = {name: found for name, found in groups.items() if found != []}
                return {name: Files([self.path / f"{name}.parquet"], found, []) for name, found in whole.items()}
            segments, rows = reading.parts(self.path, self.tell, finished=self.finished)
            found = {name: Files([], None, rows.get(name, [])) for name in tables}
            for segment in segments:
                if segment.table in found and reading.whole(self.path, segment, self.tell) is not None:
                    found[segment.table].paths.append(self.path / segment.name)
        except (OSError, pa.ArrowException) as error:
            raise _unreadable(self.path, error) from None
        return {name: files for name, files in found.items() if files.paths or files.rows}

    def events(self) -> list[Event]:
        """What was recorded, with an event of kind "record-damaged" in the place of each damaged line.

        Of a run that goes on, or was killed, with those at the end that are not in events.jsonl yet.
        """
        return list(self.each_event())

    def each_event(self) -> Iterator[Event]:
        """The same one by one, however many they are."""
        # Before the lines: what was written in between is then in both, and not in neither.
        waiting = self.waiting_events()
        yield from still_waiting(self.event_lines(), waiting)

    def waiting_events(self) -> list[Event]:
        """Those that will share a line of events.jsonl with others, as of the newest commit."""
        plain = [] if self.finished or not reading.in_segments(self.path) else reading.waiting_events(self.path)
        return [event for value in plain if (event := event_lines.to_event(value)) is not None]

    def event_lines(self) -> Iterator[Event]:
        """What is in events.jsonl."""
        try:
            yield from event_lines.events(self.path, self.tell, finished=self.finished)
        except OSError as error:
            raise _unreadable(self.path / event_lines.NAME, error) from None

    def each_event_and_damage(self) -> Iterator[Event]:
        """The same, and behind them what else was found damaged in what was read so far."""
        yield from self.each_event()
        yield from (damage for damage in self.damages if damage.details.get("file") != event_lines.NAME)

    def _responses(self, table: pa.Table, lines: Lines) -> Responses:
        shape = table.num_rows // len(lines), len(lines)
        column: dict[str, Any] = {
            name: to_numpy(table[name].combine_chunks()).reshape(shape) for name in table.column_names
        }
        value = np.empty(shape, dtype=np.complex128)
        value.real, value.imag = column["re"], column["im"]
        per_line = {name: column[name] for name in PER_LINE if name in column}
        if ADDED[0] in column:
            per_line["weight"] = np.empty(shape, dtype=np.complex128)
            per_line["weight"].real, per_line["weight"].imag = column["weight_re"], column["weight_im"]
        per_row = {name: column[name][:, 0] for name in PER_RESPONSE}
        named = {"quantity": self.found["quantity"], "unit": self.found["unit"]}
        return Responses(lines=lines, value=value, **per_line, **per_row, **named)


def _unreadable(path: Path, error: Exception) -> RecordError:
    return RecordError(
        "unreadable",
        f"{str(path)!r} cannot be read: {error}",
        "check its permissions and the disk",
        path=str(path),
        reason=str(error),
    )
