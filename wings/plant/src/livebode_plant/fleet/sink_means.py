"""MeanTier: means of responses and parameters over the periods of a clock, from a stream of results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from livebode.analysis import FittedQuantities
from livebode.core import Responses, SignalError
from livebode.fitting import RunningMean
from livebode.tables import Table
from livebode_plant.fleet.sink_rows import US, RunKey, RunPart, SinkRows, mean_place
from livebode_plant.lake import PARAMETER_MEANS, RESPONSE_MEANS
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


class Closed(NamedTuple):
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

    def take(self, message: SinkRows, log: str) -> Closed | None:
        """Take the next message; returns the means of the periods that have ended before it, if any have."""
        # A clock that was set back must not open a period again.
        self._now_s = max(self._now_s, message.stored_s)
        self._begins.setdefault(int(self._now_s // self._period_s), message.number)
        ended = int((self._now_s - _LATE_S) // self._period_s) - 1
        found = self._close(ended, log) if ended > self.closed else None
        counted = self._now_s - _LATE_S < (self.closed + 1) * self._period_s
        for part in message.responses:
            for key, rows in self._periods(part, counted=counted):
                group = self._responses.setdefault(key, _Responses(message.grids[part.key.axis, part.key.run]))
                group.add(rows)
        for part in message.parameters:
            for key, rows in self._periods(part, counted=counted):
                self._parameters.setdefault(key, FittedQuantities()).add(Table.from_arrow(rows))
        return found

    def _periods(self, part: RunPart, *, counted: bool) -> Iterator[tuple[PeriodKey, pa.Table]]:
        """The rows of each period; without those of periods that are closed, if they were `counted` there."""
        periods = part.logged_us // (self._period_s * US)
        for period in np.unique(periods).tolist():
            if period > self.closed or not counted:
                here = np.flatnonzero(periods == period)  # one after the other: a log's clock only advances
                yield PeriodKey(part.key, period), part.rows.slice(here[0], here[-1] + 1 - here[0])

    def _close(self, through: int, log: str) -> Closed:
        own = [key for key in self._responses if key.period <= through]
        fitted = [key for key in self._parameters if key.period <= through]
        tables = {
            f"fleet_responses_{self.name}": self._response_table([(k, self._responses.pop(k)) for k in own], log),
            f"fleet_parameters_{self.name}": self._parameter_table([(k, self._parameters.pop(k)) for k in fitted], log),
        }
        self.closed = through
        self._begins = {period: number for period, number in self._begins.items() if period > through}
        return Closed(through, min(self._begins.values()), tables)

    def _response_table(self, groups: list[tuple[PeriodKey, _Responses]], log: str) -> pa.Table:
        tables = [RESPONSE_MEANS.empty_table()]
        for key, group in groups:
            row = self._place(key, log) | {"responses": group.count}
            wide = to_wide(group.result())
            columns = [
                wide[one.name].cast(one.type) if one.name in wide.column_names else pa.array([row[one.name]], one.type)
                for one in RESPONSE_MEANS
            ]
            tables.append(pa.table(columns, schema=RESPONSE_MEANS))
        return pa.concat_tables(tables)

    def _parameter_table(self, groups: list[tuple[PeriodKey, FittedQuantities]], log: str) -> pa.Table:
        rows = [
            {name: value for name, value in vars(quantity.point).items() if name in PARAMETER_MEANS.names}
            | self._place(key, log)
            for key, fitted in groups
            for quantity in fitted.quantities
        ]
        return pa.Table.from_pylist(rows, PARAMETER_MEANS)

    def _place(self, key: PeriodKey, log: str) -> dict[str, Any]:
        return mean_place(key.run, key.period * self._period_s * US, log)


def _invalid(one: Responses) -> Responses:
    return replace(
        one,
        value=np.full_like(one.value, complex(np.nan, np.nan)),
        sigma=np.full_like(one.sigma, np.nan),
        valid=np.zeros_like(one.valid),
    )
