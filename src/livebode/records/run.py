"""Read a run: its directory as the objects that were written."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import field, replace
from math import nan
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from livebode.core import (
    DamageWarning,
    Event,
    Lines,
    LivebodeError,
    MatrixResponses,
    PlantKinds,
    RecordError,
    Responses,
    RunClock,
    SourceUnit,
)
from livebode.dataclass import dataclass
from livebode.locations import original
from livebode.records.grouped_events import still_waiting
from livebode.records.matrix_run import (
    entries_of,
    entry_missing,
    entry_named,
    entry_summary,
    is_matrix,
    matrix_shape,
)
from livebode.records.matrix_table import COVARIANCE_SCHEMA, MatrixShape, entry_rows, matrices
from livebode.records.matrix_table import SCHEMA as MATRIX_SCHEMA
from livebode.records.response_table import RESPONSE_SCHEMA, responses_in, with_variation
from livebode.records.segments import event_lines, reading
from livebode.records.segments.damage import KIND, loses_rows
from livebode.records.segments.json_lines import EVENTS
from livebode.records.segments.manifest import NAME as MANIFEST
from livebode.records.segments.manifest import Segment
from livebode.records.summary_file import COPY, RUN, copy_damage, read_summary
from livebode.records.summary_shape import what_is_wrong
from livebode.tables import Table

_logger = logging.getLogger(__name__)
_Part = TypeVar("_Part", Responses, MatrixResponses, Table)
_ROWS = 1 << 16  # of responses at once, times their lines: about 10 MB


def lines_in(found: Mapping[str, Any]) -> Lines:
    """The lines in `found` of run.json."""
    return Lines(tuple(found["bins"]), found["window"], found["rate_hz"], tuple(found["quiet_bins"]))


def source_unit_in(found: Mapping[str, Any]) -> SourceUnit | None:
    """The unit of the plant in the units of the source, in `found` of run.json; None if it is the same."""
    written = found.get("source_unit")
    return None if written is None else SourceUnit(**written)


def kinds_in(found: Mapping[str, Any]) -> PlantKinds:
    """The kinds of the plant in `found` of run.json; from the unit if an older version wrote it."""
    return PlantKinds(**found["kinds"]) if "kinds" in found else PlantKinds.of_unit(found.get("unit", ""))


def steady(responses: Responses, summary: Mapping[str, Any]) -> Responses:
    """Those of a machine that was ready, without a transient at the start of a live run; averages are all included."""
    left_out = int(summary.get("left_out_samples") or 0)
    averages = (summary.get("configuration", {}).get("tracking") or {}).get("average")
    use = responses.ready & (responses.first >= left_out) if left_out and not averages else responses.ready
    return responses if use.all() else responses[np.flatnonzero(use)]


@dataclass(frozen=True)
class RunRecord:
    """The directory of a run: finished, stopped, killed, or still being written.

    Reading returns what is committed at that time; a run that is being written has more later.

    Attributes
    ----------
    path
        Its directory.
    summary
        run.json.
    damages
        Damage found so far, as events of kind "record-damaged"; everything else is read.
    on_damage
        Called once with each of them; a `DamageWarning` by default.
    selected
        Output and input of the entry of a matrix run of which this is a view; it reads as an ordinary run.
    """

    path: Path
    summary: dict[str, Any]
    damages: list[Event] = field(default_factory=list, compare=False)
    on_damage: Callable[[Event], None] | None = field(default=None, compare=False)
    selected: tuple[str, str] | None = None

    @classmethod
    def open(
        cls,
        path: str | PathLike[str],
        on_damage: Callable[[Event], None] | None = None,
        *,
        output_only: bool = False,
        matrix: bool = False,
        entry: str | None = None,
    ) -> RunRecord:
        """The run in this directory; with `output_only` also one without responses, of which `lines` raises KeyError.

        With `matrix` it may be a matrix run. With `entry`, such as "velocity2/u1", it must be one, and the result is
        the view of that entry.

        Raises
        ------
        RecordError
            If it is not from a run, or run.json or the responses cannot be read, or it has no responses; if it is a
            matrix run and no entry is named, or has no such entry.
        GridError
            If the lines in run.json are not a valid grid.
        """
        path = Path(path)
        summary, damaged = read_summary(path)
        run = cls(path, summary, on_damage=on_damage)
        if wrong := what_is_wrong(summary):
            raise RecordError(
                "unexpected-content",
                f"{str(path / RUN)!r} has an invalid value ({wrong})",
                "run the recording again",
                path=str(path / RUN),
                reason=wrong,
            )
        if run.output_only and not output_only:
            raise RecordError(
                "no-responses",
                f"{str(path)!r} is an output-only run: it has modes and no responses",
                "read its table parameters with livebode export, by SQL or as a file",
                path=str(path),
            )
        try:
            len(() if run.output_only else run.lines)
        except LivebodeError as error:
            raise error.at(str(path / RUN)) from None
        copy_damaged = "" if damaged else copy_damage(path)
        for file, message in ((RUN, damaged), (COPY, copy_damaged)):
            if message:
                run.report(Event(KIND, 0, 0.0, message, {"file": file}))
        if entry is not None:
            return run.entry(*entry_named(str(path), summary, entry))
        if run.is_matrix and not matrix:
            raise entry_missing(str(path), summary)
        return run

    def report(self, damage: Event) -> None:
        """Record damage that was found."""
        if damage not in self.damages:
            self.damages.append(damage)
            _logger.warning("%s: %s", self.path, damage.message)
            if self.on_damage is not None:
                self.on_damage(damage)
                return
            warnings.warn(f"{self.place}: {damage.message}", DamageWarning, stacklevel=2)

    @property
    def place(self) -> str:
        """Where it is, for its user: its path, or the URL that this is a copy of."""
        return original(str(self.path))

    @property
    def found(self) -> dict[str, Any]:
        """Rate, window, lines, quantity and unit from run.json."""
        return dict(self.summary["found"])

    @property
    def output_only(self) -> bool:
        """Whether the run has modes in its parameters and no responses."""
        return bool(self.summary.get("output_only", False))

    @property
    def is_matrix(self) -> bool:
        """Whether it has matrices of responses; a view of one entry has none."""
        return is_matrix(self.summary)

    @property
    def entries(self) -> dict[str, tuple[str, str]]:
        """Output and input of each entry of a matrix run, by its name "output/input"; none of an ordinary run."""
        return entries_of(self.summary)

    @property
    def entry_name(self) -> str | None:
        """Of a view of one entry its name, "output/input"; None of another run."""
        return None if self.selected is None else "/".join(self.selected)

    def entry(self, output: str, input: str) -> RunRecord:
        """The view of one entry of a matrix run as an ordinary run.

        Raises
        ------
        RecordError
            If it is not a matrix run, or has no such entry.
        """
        chosen = entry_named(str(self.path), self.summary, f"{output}/{input}")
        return replace(self, summary=entry_summary(self.summary, *chosen), selected=chosen)

    @property
    def _matrix_shape(self) -> MatrixShape:
        """Its lines and signals; RecordError if it is not a matrix run."""
        if not self.is_matrix:
            raise RecordError(
                "no-matrix",
                f"{str(self.path)!r} has one response, and no matrix of them",
                "read its responses",
                path=str(self.path),
            )
        return matrix_shape(self.summary, self.lines)

    def matrix(self) -> MatrixResponses:
        """All matrices of a matrix run, as written; no rows before the first.

        Raises
        ------
        RecordError
            If it is not a matrix run, or damage leaves no matrix.
        """
        shape = self._matrix_shape
        none = matrices([Table.empty(MATRIX_SCHEMA)], [], shape)
        return MatrixResponses.join(
            list(self.undamaged(self.matrix_batches())) or [self._with_units(responses) for responses in none]
        )

    def matrix_batches(
        self, size_bytes_max: int | None = None, span_s: tuple[float, float] | None = None
    ) -> Iterator[MatrixResponses]:
        """All readable matrices in order, in parts of bounded size; or the newest, from files up to this size.

        With `span_s`, segments completely outside of that time are skipped.

        Raises
        ------
        RecordError
            If it is not a matrix run.
        """
        shape = self._matrix_shape
        rows, factors = self.tables("responses", size_bytes_max, span_s), self.tables("covariance", span_s=span_s)
        responses = self._whole(rows, shape.response_rows, MATRIX_SCHEMA.names)
        covariance = self._whole(factors, shape.covariance_rows, COVARIANCE_SCHEMA.names)
        yield from map(self._with_units, matrices(responses, covariance, shape))

    def _with_units(self, responses: MatrixResponses) -> MatrixResponses:
        return replace(responses, units=tuple(map(tuple, self.summary["found"]["units"])))

    @property
    def lines(self) -> Lines:
        """Source of the measurement."""
        return lines_in(self.found)

    @property
    def kinds(self) -> PlantKinds:
        """Kinds of the plant's output and input."""
        return kinds_in(self.summary["found"])

    @property
    def clock(self) -> RunClock:
        """Relation of its times to the time of day; from the first response if an older version recorded it."""
        first_s = nan
        if "clock" not in self.summary and "clock" not in self.summary["found"]:
            with suppress(LivebodeError):  # the clock of damaged responses has no use
                first_s = next((float(part.time_s[0]) for part in self.batches() if len(part)), nan)
        return RunClock.of(self.summary, first_s)

    @property
    def finished(self) -> bool:
        """Whether its source ended and everything is written."""
        return bool(self.summary.get("record", {}).get("finished", True))

    @property
    def ended(self) -> bool:
        """Whether it is complete: finished, or ended by a person or a service manager, from where it can continue."""
        return self.finished or bool(self.summary["record"].get("ended", False))

    def responses(self) -> Responses:
        """All responses, as written; an empty batch before the first.

        Raises
        ------
        RecordError
            If it is a matrix run, or damage leaves no response.
        """
        return Responses.join(
            list(self.undamaged(self.batches())) or [responses_in(Table.empty(RESPONSE_SCHEMA), self.lines, self.found)]
        )

    def batches(self, size_bytes_max: int | None = None) -> Iterator[Responses]:
        """All readable responses in order, in parts of bounded size; or the newest, from files up to this size."""
        return self._in_parts(self.tables("responses", size_bytes_max))

    def steady_batches(self) -> Iterator[Responses]:
        """Those of a machine that was ready, without a transient at the start of a live run.

        Averaged responses are all included. RecordError while iterating if damage leaves no response.
        """
        return (steady(part, self.summary) for part in self.undamaged(self.batches()))

    def between(self, from_s: float, to_s: float) -> Iterator[Responses]:
        """Responses with an effective time in this span, including its ends, in parts; other segments are not read."""
        for part in self._in_parts(self.tables("responses", span_s=(from_s, to_s))):
            if len(within := part.between(from_s, to_s)):
                yield within

    def _in_parts(self, tables: Iterator[Table]) -> Iterator[Responses]:
        if self.is_matrix:
            raise entry_missing(str(self.path), self.summary)
        lines = self.lines
        for table in self._whole(tables, len(lines), RESPONSE_SCHEMA.names):
            yield responses_in(table, lines, self.found)

    def _whole(self, tables: Iterator[Table], rows: int, columns: list[str]) -> Iterator[Table]:
        """The rows of whole responses, `rows` each, in parts of bounded size; RecordError if they are of no run."""
        remainder: Table | None = None
        for part in tables:
            self._check_columns(part, columns)
            for start in range(0, part.num_rows, _ROWS):
                piece = part.slice(start, _ROWS)
                table = piece if remainder is None else Table.join([remainder, piece])
                whole = table.num_rows // rows * rows
                remainder = table.slice(whole)
                if whole:
                    yield table.slice(0, whole)
        if remainder is not None and remainder.num_rows:
            raise RecordError(
                "unexpected-content",
                f"the record in {str(self.path)!r} ends within a response",
                "run the recording again",
                path=str(self.path),
            )

    def _check_columns(self, table: Table, columns: list[str]) -> None:
        if table.schema.names != columns:
            raise RecordError(
                "unexpected-content",
                f"the responses in {str(self.path)!r} have unexpected columns",
                "run the recording again",
                path=str(self.path),
                columns=table.schema.names,
            )

    def tables(
        self, name: str, size_bytes_max: int | None = None, span_s: tuple[float, float] | None = None
    ) -> Iterator[Table]:
        """The rows of "responses", "parameters" or "samples" in order, part by part; none if it was not recorded.

        A matrix run also has "covariance". With `span_s`, segments completely outside of that time are skipped.

        Raises
        ------
        RecordError
            While iterating, if nothing can be read, or the content is not from a run. A damaged part is skipped and
            reported in `damages`.
        """
        rows = self._recorded_tables(name, size_bytes_max, span_s)
        if self.selected is None or name != "responses":
            yield from rows
            return
        for table in rows:
            self._check_columns(table, MATRIX_SCHEMA.names)
            yield entry_rows(table, *self.selected)

    def _recorded_tables(
        self, name: str, size_bytes_max: int | None, span_s: tuple[float, float] | None
    ) -> Iterator[Table]:
        file = self.path / name
        try:
            rows = reading.tables(
                self.path, name, self.report, size_bytes_max, span_s, manifest_bytes=self._manifest_bytes
            )
            yield from map(with_variation, rows) if name == "responses" else rows
        except LivebodeError:  # it is a ValueError
            raise
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise _unreadable(file, error) from None

    def undamaged(self, parts: Iterator[_Part], table: str = "responses") -> Iterator[_Part]:
        """These parts of a table.

        Raises
        ------
        RecordError
            After the last one, if there was none because a file of the table is damaged or missing.
        """
        empty = True
        for part in parts:
            empty = False
            yield part
        if empty and (error := self.loss(table)) is not None:
            raise error

    def loss(self, table: str) -> RecordError | None:
        """The error for a table of which no row is left, after it was read; None if no damage explains that."""
        if table == "responses" and self.summary.get("counts", {}).get("responses") == 0:
            return None
        file = next((damage.details["file"] for damage in self.damages if loses_rows(damage, table)), None)
        if file is None:
            return None
        return RecordError(
            "damaged",
            f"{file} of {str(self.path)!r} is damaged or missing, and no rows of {table} are left",
            "track the recording again with `livebode run --force`, or restore the file",
            path=str(self.path / file),
            table=table,
        )

    @property
    def _manifest_bytes(self) -> int | None:
        """Length of the manifest of a finished run, 0 if it is not known; None of an unfinished one."""
        return self.summary.get("size_bytes", {}).get(MANIFEST, 0) if self.finished else None

    @property
    def segments(self) -> list[Segment]:
        """The existing closed segments, by age."""
        try:
            manifest = reading.read_manifest(self.path, self.report)
        except OSError as error:
            raise _unreadable(self.path, error) from None
        return [] if manifest is None else manifest.segments

    def parts(self) -> tuple[list[Segment], reading.Rows]:
        """The closed segments of all tables, by age, and later rows of each."""
        try:
            return reading.parts(self.path, self.report, self._manifest_bytes)
        except OSError as error:
            raise _unreadable(self.path, error) from None

    def check(self, tables: Collection[str]) -> int:
        """Compare the files of these tables with their checksums; number of the intact rows. Damage is reported."""
        segments, rows = self.parts()
        closed = sum(
            reading.check_segment(self.path, segment, self.report) for segment in segments if segment.table in tables
        )
        return closed + sum(batch.num_rows for table in tables for batch in rows.get(table, ()))

    def events(self) -> list[Event]:
        """Recorded events; each damaged line is replaced by an event of kind "record-damaged".

        For a run that continues or was killed, this includes the last events that are not in events.jsonl yet.
        """
        return list(self.each_event())

    def each_event(self) -> Iterator[Event]:
        """The same one by one, in bounded memory."""
        lines, waiting = self.event_lines()
        yield from still_waiting(lines, waiting)

    def event_lines(self) -> tuple[Iterator[Event], list[Event]]:
        """Events in events.jsonl, and those of the newest commit that will share a line of it."""
        # The commit before the lines: events written in between are then in both instead of in neither.
        commit = None if self.finished else reading.newest_commit(self.path)
        if commit is None:
            return self._event_lines(self.summary.get("size_bytes", {}).get(EVENTS, 0)), []
        waiting = [event for value in commit.waiting if (event := event_lines.to_event(value)) is not None]
        return self._event_lines(commit.events_bytes), waiting

    def _event_lines(self, least_bytes: int) -> Iterator[Event]:
        try:
            yield from event_lines.events(self.path, self.report, finished=self.finished, least_bytes=least_bytes)
        except OSError as error:
            raise _unreadable(self.path / EVENTS, error) from None

    def each_event_and_damage(self) -> Iterator[Event]:
        """The same, followed by other damage found so far."""
        yield from self.each_event()
        yield from (damage for damage in self.damages if damage.details.get("file") != EVENTS)


def _unreadable(path: Path, error: Exception) -> RecordError:
    return RecordError(
        "unreadable",
        f"{str(path)!r} cannot be read: {error}",
        "check its permissions and the disk",
        path=str(path),
        reason=str(error),
        errno=getattr(error, "errno", None),
    )
