"""SinkTables: messages of results as rows of a lake, and their means over periods of a clock, each of them once."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, field, replace
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from livebode.analysis import FittedQuantities
from livebode.core import LEVELS, ArchiveError, Responses, SignalError, counted
from livebode.dataclass import dataclass
from livebode.fitting import RunningMean
from livebode.tables import Table
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.reader import StoredMessage
from livebode_plant.fleet.sink_rows import (
    DELETED,
    US,
    RunKey,
    RunPart,
    SinkRows,
    dated,
    event_rows,
    run_place,
    run_rows,
    sink_rows,
)
from livebode_plant.fleet.subjects import RESULT_STREAM, axis_names
from livebode_plant.lake import TABLES, Lake, StreamTable
from livebode_plant.lake.wide_responses import from_wide, to_wide

MINUTE_S, HOUR_S = 60, 3600
_LATE_S = 5.0
"""From the end of a period until its means are computed: results are stored some time after their samples."""
_ROWS_MAX = 512
"""Rows of a run that wait to be averaged together: each averaging costs as much as many rows."""


class PeriodKey(NamedTuple):
    """A run of an axis in one period, counted from 1970 in periods."""

    run: RunKey
    period: int


@dataclass
class _Responses:
    """Responses of a run in a period, averaged in parts."""

    grid: Mapping[str, Any]
    mean: RunningMean = field(default_factory=RunningMean)
    newest: Responses | None = None
    count: int = 0
    waiting: list[pa.Table] = field(default_factory=list)
    rows: int = 0

    def add(self, rows: pa.Table) -> None:
        self.waiting.append(rows)
        self.count += rows.num_rows
        self.rows += rows.num_rows
        if self.rows >= _ROWS_MAX:
            self._average()

    def _average(self) -> None:
        if self.waiting:
            responses = from_wide(pa.concat_tables(self.waiting), self.grid)
            self.mean.add(responses)
            self.newest, self.waiting, self.rows = responses[-1:], [], 0

    def result(self) -> Responses:
        """The mean; without a valid response the newest one, with all lines invalid."""
        self._average()
        try:
            return self.mean.response()
        except SignalError:
            assert self.newest is not None
            return _invalid(self.newest)


class ClosedPeriods(NamedTuple):
    """The means of the periods up to number `through`.

    `first` is the number of the first message that has to be read again for the means of later periods.
    """

    through: int
    first: int
    tables: Mapping[str, pa.Table]


class MeanTier:
    """Means over minutes or hours, each of them once.

    When a period ends depends on nothing but the messages and their times in the log, so that a sink which was killed,
    and reads them again, computes the same means: those that are committed are left out. A result that is stored later,
    because its owner was behind, gives a second row of the same period.

    Parameters
    ----------
    name
        "minute" or "hour".
    period_s
        Length.
    closed
        Number of the newest period whose means are committed.
    """

    def __init__(self, name: str, period_s: int, closed: int) -> None:
        self.name, self._period_s, self.closed = name, period_s, closed
        self._now_s = 0.0
        self._begins: dict[int, int] = {}
        self._responses: dict[PeriodKey, _Responses] = {}
        self._parameters: dict[PeriodKey, FittedQuantities] = {}

    def process(self, message: SinkRows, log: str) -> ClosedPeriods | None:
        """Add the next message; returns the means of the periods that have ended before it, if any have."""
        # A clock that was set back must not open a period again.
        self._now_s = max(self._now_s, message.stored_s)
        self._begins.setdefault(int(self._now_s // self._period_s), message.number)
        ended = int((self._now_s - _LATE_S) // self._period_s) - 1
        closed = self._close(ended, log) if ended > self.closed else None
        counted = self._now_s - _LATE_S < (self.closed + 1) * self._period_s
        for part in message.responses:
            for key, rows in self._periods(part, counted=counted):
                group = self._responses.setdefault(key, _Responses(message.grids[part.key.axis, part.key.run]))
                group.add(rows)
        for part in message.parameters:
            for key, rows in self._periods(part, counted=counted):
                self._parameters.setdefault(key, FittedQuantities()).add(Table.from_arrow(rows))
        return closed

    def _periods(self, part: RunPart, *, counted: bool) -> Iterator[tuple[PeriodKey, pa.Table]]:
        """The rows of each period; without those of periods that are closed, if they were `counted` there."""
        periods = part.logged_us // (self._period_s * US)
        for period in np.unique(periods).tolist():
            if period > self.closed or not counted:
                here = np.flatnonzero(periods == period)  # one after the other: a log's clock only advances
                yield PeriodKey(part.key, period), part.rows.slice(here[0], here[-1] + 1 - here[0])

    def _close(self, through: int, log: str) -> ClosedPeriods:
        own = [key for key in self._responses if key.period <= through]
        fitted = [key for key in self._parameters if key.period <= through]
        responses, parameters = f"fleet_responses_{self.name}", f"fleet_parameters_{self.name}"
        tables = {
            responses: self._response_table(responses, [(key, self._responses.pop(key)) for key in own], log),
            parameters: self._parameter_table(parameters, [(key, self._parameters.pop(key)) for key in fitted], log),
        }
        self.closed = through
        self._begins = {period: number for period, number in self._begins.items() if period > through}
        return ClosedPeriods(through, min(self._begins.values()), tables)

    def _response_table(self, name: str, groups: list[tuple[PeriodKey, _Responses]], log: str) -> pa.Table:
        schema = TABLES[name].schema
        tables = [schema.empty_table()]
        for key, group in groups:
            row = self._place(key, log) | {"responses": group.count}
            wide = to_wide(group.result())
            columns = [wide[f.name].cast(f.type) if f.name in wide.column_names else pa.array([row[f.name]], f.type)
                       for f in schema]  # fmt: skip
            tables.append(pa.table(columns, schema=schema))
        return pa.concat_tables(tables)

    def _parameter_table(self, name: str, groups: list[tuple[PeriodKey, FittedQuantities]], log: str) -> pa.Table:
        rows = [
            vars(quantity.point) | self._place(key, log) for key, fitted in groups for quantity in fitted.quantities
        ]
        return pa.Table.from_pylist(rows, TABLES[name].schema)

    def _place(self, key: PeriodKey, log: str) -> dict[str, Any]:
        return run_place(*key.run, log) | dated("logged_from", key.period * self._period_s)


def _invalid(newest: Responses) -> Responses:
    return replace(
        newest,
        value=np.full_like(newest.value, complex(np.nan, np.nan)),
        sigma=np.full_like(newest.sigma, np.nan),
        valid=np.zeros_like(newest.valid),
    )


_WAITING_BYTES_MAX = 64 << 20
_BY_MESSAGE = ("fleet_runs", "fleet_events", "fleet_parameters", "fleet_responses")
"""Tables whose position is the number of a message. The last one is committed last, always: all of them have what is
before its position."""
_TIERS = {"minute": MINUTE_S, "hour": HOUR_S}
_logger = logging.getLogger(f"livebode.{__name__}")


@dataclass
class SinkTotals:
    """What a sink has stored since it began, and the messages that the log had deleted before they were read."""

    responses: int = 0
    parameters: int = 0
    events: int = 0
    deleted: int = 0

    def as_dict(self) -> dict[str, int]:
        """Plain data."""
        return asdict(self)


class _WaitingRows:
    """Rows that are not committed yet, with the position of each part in the stream."""

    def __init__(self, table: StreamTable) -> None:
        self.table = table
        self._parts: list[tuple[int, pa.Table]] = []

    def __bool__(self) -> bool:
        return bool(self._parts)

    @property
    def nbytes(self) -> int:
        return sum(rows.nbytes for _, rows in self._parts)

    def add(self, at: int, rows: pa.Table) -> None:
        if rows.num_rows:
            self._parts.append((at, rows))

    def after(self, position: int) -> pa.Table:
        return pa.concat_tables([self.table.schema.empty_table(), *(rows for at, rows in self._parts if at > position)])

    def commit(self, stream: str, through: int, further: Mapping[str, int] | None = None) -> None:
        self.table.append(stream, through, self.after, further)
        self._parts.clear()


class SinkTables:
    """The tables of a lake, to which messages of results are added in their order.

    Parameters
    ----------
    settings
        The lake, and how long what is retained there.
    """

    def __init__(self, settings: SinkSection) -> None:
        self._settings = settings
        self.lake = Lake(settings.url)
        names = [name for name, table in TABLES.items() if table.days]
        self._waiting = {name: _WaitingRows(StreamTable(self.lake, name)) for name in names}
        self.totals = SinkTotals()

    def resume(self, created_s: float) -> int:
        """Find where the lake ends; returns the number of the message from which on to read.

        `created_s` is when the stream was created, and so distinguishes it from others.
        """
        self.name = datetime.fromtimestamp(created_s, UTC).isoformat()
        self._stream = f"livebode {RESULT_STREAM} {self.name}"
        main = self._waiting[_BY_MESSAGE[-1]].table
        self._through = self._committed = main.position(self._stream)
        self._stored_s = self._committed_s = main.position(f"{self._stream} stored") / 1000
        self._tiers = []
        firsts = [self._committed + 1]
        for name, period_s in _TIERS.items():
            table = self._waiting[f"fleet_responses_{name}"].table
            self._tiers.append(MeanTier(name, period_s, table.position(self._stream)))
            firsts.append(table.position(f"{self._stream} first") or 1)
        self._firsts: dict[str, tuple[int, int]] = {}
        self._next = min(firsts)
        known = self.lake.read("fleet_runs", [*LEVELS, "log", "run"])
        self._runs = {tuple(row.values()) for row in known.to_pylist()}
        self._due_s = time.monotonic() + self._settings.commit_s
        self.clean()
        return self._next

    @property
    def through(self) -> tuple[int, float]:
        """Number of the message up to which the lake has the results, and when the log stored what was read last."""
        waits = any(self._waiting[name] for name in _BY_MESSAGE)
        return self._committed if waits else self._through, self._committed_s if waits else self._stored_s

    def process(self, messages: list[StoredMessage]) -> list[pa.Table]:
        """Add the next messages, and commit if it is time; returns the events that are new."""
        events = [
            rows.tables["fleet_events"] for message in messages if (rows := self._add_message(message)) is not None
        ]
        full = sum(waiting.nbytes for waiting in self._waiting.values()) > _WAITING_BYTES_MAX
        if full or time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + self._settings.commit_s
            self.commit()
            if datetime.now(UTC).date() != self._cleaned:
                self._clean_while_running()
        return events

    def _add_message(self, message: StoredMessage) -> SinkRows | None:
        """Add a message; returns its rows if the lake does not have them."""
        if message.number > self._next:
            self._report_deleted(message)
        self._next = message.number + 1
        rows = sink_rows(message, self.name)
        for tier in self._tiers:
            if (closed := tier.process(rows, self.name)) is not None:
                for name, table in closed.tables.items():
                    self._waiting[name].add(closed.through, table)
                self._firsts[tier.name] = closed.through, closed.first
        self._through = max(self._through, message.number)
        self._stored_s = message.stored_s
        if message.number <= self._committed:
            return None
        self._add(rows)
        return rows

    def _add(self, rows: SinkRows) -> None:
        self._waiting["fleet_runs"].add(rows.number, self._new_runs(rows))
        for name, table in rows.tables.items():
            self._waiting[name].add(rows.number, table)
        self.totals.responses += rows.tables["fleet_responses"].num_rows
        self.totals.parameters += rows.tables["fleet_parameters"].num_rows
        self.totals.events += rows.tables["fleet_events"].num_rows

    def _new_runs(self, rows: SinkRows) -> pa.Table:
        """Rows of the runs that the lake does not have yet."""
        new: dict[RunKey, Mapping[str, Any]] = {}
        logged_s: dict[RunKey, float] = {}
        for key, _, logged_us in rows.responses:
            known = (*axis_names(key.axis), self.name, key.run)
            if known not in self._runs:
                self._runs.add(known)
                new[key], logged_s[key] = rows.grids[key.axis, key.run], logged_us[0] / US
        return run_rows(new, logged_s, self.name)

    def _report_deleted(self, message: StoredMessage) -> None:
        """Report the messages before this one that the log has deleted, without those that are in the lake already."""
        first, last = max(self._next, self._committed + 1), message.number - 1
        if first > last:
            _logger.warning("the log has deleted results of an open period: its means have fewer responses")
            return
        since, until = (_shown(at_s) for at_s in (self._stored_s, message.stored_s))
        sentence = (
            f"the log has deleted {counted(last + 1 - first, 'message')} of results (number {first} to {last}), stored "
            f"between {since} and {until}, before they were read: raise log.results_gb, or run the sink all the time"
        )
        _logger.warning("%s", sentence)
        about = {"first": first, "last": last, "from_s": self._stored_s or None, "to_s": message.stored_s}
        event = {"kind": DELETED, "message": sentence, "details": about}
        self._waiting["fleet_events"].add(message.number, event_rows([event], {}, {}, message.stored_s, self.name))
        self.totals.deleted += last + 1 - first

    def commit(self) -> None:
        """Commit what waits; a kill between two tables leaves each with a position of its own."""
        for tier in self._tiers:
            if tier.name in self._firsts:
                through, first = self._firsts.pop(tier.name)
                fitted, main = (self._waiting[f"fleet_{kind}_{tier.name}"] for kind in ("parameters", "responses"))
                if fitted:
                    fitted.commit(self._stream, through)
                main.commit(self._stream, through, {f"{self._stream} first": first})
        *others, main = (self._waiting[name] for name in _BY_MESSAGE)
        if not any((*others, main)):
            return
        for waiting in others:
            if waiting:
                waiting.commit(self._stream, self._through)
        main.commit(self._stream, self._through, {f"{self._stream} stored": round(self._stored_s * 1000)})
        self._committed, self._committed_s = self._through, self._stored_s

    def clean(self) -> None:
        """Delete what is older than it is retained, and join the small files of earlier days."""
        now = datetime.now(UTC)
        self._cleaned = now.date()
        self.lake.check()
        for name, days in (("", self._settings.full_rate_days), ("_minute", self._settings.minute_days)):
            for kind in ("responses", "parameters"):
                self._waiting[f"fleet_{kind}{name}"].table.delete_before((now - timedelta(days=days)).date())
        for waiting in self._waiting.values():
            waiting.table.join_before(self._cleaned)
            waiting.table.remove_unused()

    def _clean_while_running(self) -> None:
        """Clean, or leave the lake as it is: files of somebody else there are no reason to lose results of the log."""
        try:
            self.clean()
        except ArchiveError as error:
            if error.code != "archive.foreign-files":
                raise
            _logger.warning("%s", error)


def _shown(at_s: float) -> str:
    """A time of the log in UTC; 0 is before the first message that was read."""
    return f"{datetime.fromtimestamp(at_s, UTC):%Y-%m-%d %H:%M:%S} UTC" if at_s else "its beginning"
