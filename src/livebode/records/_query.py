"""SQL on a run, by DuckDB (extra `query`)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from math import nan
from typing import TYPE_CHECKING, Any

from livebode.core import Event, RunClock, UsageError, moment, moments_by, needing
from livebode.dataclass import dataclass
from livebode.records.confined_sql import QueryResult, QueryTables, answer_query
from livebode.records.grouped_events import each_event, event_rows
from livebode.records.json_format import to_json
from livebode.records.run import RunRecord
from livebode.records.segments.manifest import TIERS, Segment
from livebode.records.segments.reading import segment_rows
from livebode.tables import Table

with needing("PyArrow", "query", "a query"):
    import pyarrow as pa
with needing("nanoarrow", "query", "a query"):
    import nanoarrow as na

if TYPE_CHECKING:
    import pyarrow.dataset as ds

_TABLES = ("responses", "covariance", "parameters", "samples", *TIERS)
_SINGLE_EVENTS = pa.schema(
    [
        ("kind", pa.string()),
        ("sample", pa.int64()),
        ("time_s", pa.float64()),
        ("moment", pa.string()),
        ("message", pa.string()),
        ("details", pa.string()),
    ]
)
_AT_ONCE_BYTES = 32 << 20  # of the one file of a table: to read all of it costs less than to load Arrow's data sets
_NEVER_MISSING = ("time_s", "frequency_hz")  # as plain columns, so that conditions on them reach the files
_COUNTS = [("count", pa.int64()), ("first_s", pa.float64()), ("last_s", pa.float64())]
_EVENTS = pa.schema([*_SINGLE_EVENTS, *_COUNTS])


def query(run: RunRecord, sql: str, rows_max: int) -> QueryResult:
    """The first rows of a query on the tables of rows, the events, single_events, and the tiers.

    Parameters
    ----------
    run
        Finished, killed, or being written; the query uses what is committed at its start.
    sql
        DuckDB's SQL. It can read these tables and no files.
    rows_max
        Most rows to return.

    Raises
    ------
    ExtraError
        If DuckDB is not installed.
    UsageError
        If the query cannot be run.
    RecordError
        If the run cannot be read, or damage leaves no row of a requested table.
    """
    damages: list[Event] = []  # found in Arrow's threads
    absent: set[str] = set()

    def show(database: Any, asked: set[str]) -> None:
        absent.update(_show(run, database, asked, damages))

    try:
        with _reporting(run, damages):
            return answer_query(sql, rows_max, QueryTables("run", _TABLES, show, lambda: _known(run)))
    except UsageError:
        for loss in map(run.loss, sorted(absent)):
            if loss is not None:
                raise loss from None
        raise


@contextmanager
def _reporting(run: RunRecord, damages: list[Event]) -> Iterator[None]:
    """Report these at the end, in the thread of the caller."""
    try:
        yield
    finally:
        for damage in damages:
            run.report(damage)


def _known(run: RunRecord) -> list[str]:
    segments, rows = run.parts()
    recorded = {segment.table for segment in segments} | rows.keys()
    left = (table for table in _TABLES if table in recorded and (run.check([table]) or run.loss(table) is None))
    return ["events", "single_events", *left]


def _show(run: RunRecord, database: Any, asked: set[str], damages: list[Event]) -> set[str]:
    """Register the requested tables of the run, and its events, in the database; those that are absent."""
    tables = [table for table in _TABLES if table in asked]
    if asked & {"events", "single_events"}:
        run.check(tables)  # so that these have the damage of the requested tables
    shown = _parts_of(run, tables, damages)
    for table, parts in shown.items():
        selected = []
        for number, part in enumerate(parts):
            database.register(f"_{table}_{number}", part.rows)
            columns = "*" if table == "samples" else _nan_as_null(part.rows.schema)
            # A condition on the time that contradicts this one excludes the part before its files are opened.
            span = f" WHERE time_s BETWEEN {part.first_s!r} AND {part.last_s!r}" if part.first_s <= part.last_s else ""
            selected.append(f"SELECT {columns} FROM _{table}_{number}{span}")
        database.execute(f"CREATE VIEW {table} AS {' UNION ALL '.join(selected)}")
    lines = list(run.each_event_and_damage())
    clock = run.clock
    rows = [_plain(row.newest, clock) | vars(row) for row in event_rows(lines)]
    database.register("events", _of_rows(rows, _EVENTS))
    each = [_plain(one, clock) for event in lines for one in each_event(event)]
    database.register("single_events", _of_rows(each, _SINGLE_EVENTS))
    return set(tables) - shown.keys()


@dataclass(frozen=True)
class _Part:
    """A part of a table, and its span of time; NaN: not known."""

    rows: ds.Dataset | pa.Table
    first_s: float = nan
    last_s: float = nan


def _parts_of(run: RunRecord, tables: list[str], damages: list[Event]) -> dict[str, list[_Part]]:
    """The recorded ones of these tables in parts."""
    segments, rows = run.parts()
    parts: dict[str, list[_Part]] = {}
    for table in tables:
        parts[table] = _closed(run, [segment for segment in segments if segment.table == table], damages)
        parts[table] += [_Part(_in_arrow(batch)) for batch in rows.get(table, ())]
    return {table: of_table for table, of_table in parts.items() if of_table}


def _closed(run: RunRecord, segments: list[Segment], damages: list[Event]) -> list[_Part]:
    """The segments of a table: a single one, as of a finished run, at once; of several those that a query needs."""
    if not segments:
        return []
    if len(segments) == 1 and segments[0].size_bytes <= _AT_ONCE_BYTES:
        intact = list(segment_rows(run.path, segments[0], damages.append))
        return [_Part(_in_arrow(Table.join(intact)), segments[0].first_s, segments[0].last_s)] if intact else []
    from livebode.records.segments.verified_files import segment_groups  # with pandas, where it is installed

    return [_Part(group.rows, group.first_s, group.last_s) for group in segment_groups(run.path, segments, damages)]


def _in_arrow(stream: Any) -> pa.Table:
    """The table of a stream: `pa.table` imports pandas where it is installed."""
    return pa.RecordBatchReader.from_stream(stream).read_all()


def _of_rows(rows: list[dict[str, Any]], schema: pa.Schema) -> pa.Table:
    columns = [na.c_array([row[field.name] for row in rows], field.type) for field in schema]
    return _in_arrow(na.c_array_stream(na.c_array_from_buffers(schema, len(rows), [None], 0, children=columns)))


def _plain(event: Event, clock: RunClock) -> dict[str, Any]:
    with moments_by(clock):
        return asdict(event) | {"details": to_json(event.details), "moment": moment(event.time_s)}


def _nan_as_null(schema: pa.Schema) -> str:
    """All columns, with null for missing values, which SQL's averages ignore."""
    numbers = [field.name for field in schema if pa.types.is_floating(field.type) and field.name not in _NEVER_MISSING]
    return "* REPLACE (" + ", ".join(f"CASE WHEN isnan({n}) THEN NULL ELSE {n} END AS {n}" for n in numbers) + ")"
