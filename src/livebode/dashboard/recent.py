"""The newest responses, no denser than a person can see, and the fits of the whole run, in bounded memory."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Parameters, Responses, RowArrays
from livebode.dataclass import dataclass

ROWS_MAX = 2400
EVERY_S = 0.05
"""At most one response is retained per interval of this many seconds: 2,400 are two minutes."""
_VALUES_MAX = 1 << 21
RECORDED_VALUES_MAX = 1 << 13
"""Responses × lines of a run with a journal, about 0.5 MB: older ones are in the record, and there may be many axes."""
_PARTS_MAX = 16
_SLACK = 1.25  # joining copies everything: it is done after a quarter of new rows, not after each


class RecentResponses:
    """The newest responses of a stream, one per `EVERY_S` of the machine's time.

    Parameters
    ----------
    values_max
        Largest number of values (responses × lines), but at least 64 responses are permitted.
    """

    def __init__(self, values_max: int = _VALUES_MAX) -> None:
        self._values_max = values_max
        self.count = 0
        self._parts: list[Responses] = []
        self._kept = 0
        self._slot: int | None = None

    def add(self, responses: Responses) -> None:
        """Add responses; the first of each interval is retained."""
        time_s = np.where(np.isfinite(responses.time_s), responses.time_s, 0.0)
        slot = np.floor(time_s / EVERY_S).astype(np.int64)
        first = np.ones(len(slot), dtype=bool)
        first[1:] = slot[1:] != slot[:-1]
        if len(slot) and slot[0] == self._slot:
            first &= slot != self._slot
        if not first.any():
            return
        self._slot = int(slot[-1])
        kept = responses[np.flatnonzero(first)[-self._most(responses) :]]
        self._parts.append(kept)
        self._kept += len(kept)
        self.count += len(kept)
        if len(self._parts) > _PARTS_MAX or self._kept > _SLACK * self._most(responses):
            # A one-row part takes three times the memory of its data, for its array objects. Joined rows are a copy.
            self._parts = [Responses.join(self._without_oldest(self._kept - self._most(responses)))]
            self._kept = len(self._parts[0])

    def newest(self, rows: int) -> Responses | None:
        """The last rows, up to this number."""
        if not self._parts or rows <= 0:
            return None
        index = len(self._parts)
        count = 0
        while index and count < rows:
            index -= 1
            count += len(self._parts[index])
        first = self._parts[index][-(rows - count + len(self._parts[index])) :]
        return Responses.join([first, *self._parts[index + 1 :]])

    def _without_oldest(self, rows: int) -> list[Responses]:
        first, *others = self._parts
        while others and rows >= len(first):
            rows, (first, *others) = rows - len(first), others
        return [first[max(0, rows) :], *others]

    def all(self) -> Responses | None:
        """All retained responses."""
        return self.newest(self._most(self._parts[-1])) if self._parts else None

    def _most(self, responses: Responses) -> int:
        return max(64, min(ROWS_MAX, self._values_max // max(1, len(responses.lines))))


POINTS_MAX = 1024
TRENDS_MAX = 256
_TREND_PARTS_MAX = 16
_TAIL = 64  # newest rows that are all retained: the newest of a batch may be rejected, and one before it shown


@dataclass(frozen=True, eq=False)
class TrendRows(RowArrays):
    """Parameters of one model over time: value and sigma (rows, parameters), the others (rows,)."""

    time_s: Floats
    schedule: Floats
    value: Floats
    sigma: Floats
    status: NDArray[Any]


class ModelTrend:
    """Every n-th row of the parameters of a model, with n doubled whenever there are too many, and the newest row."""

    def __init__(self, model: str, names: Sequence[str], units: Sequence[str]) -> None:
        self.model, self.names, self.units = model, tuple(names), tuple(units)
        self.newest: TrendRows | None = None
        self._tail: TrendRows | None = None
        self._rows: list[TrendRows] = []
        self._seen, self._stride, self._kept = 0, 1, 0

    def add(self, rows: TrendRows) -> None:
        """Append rows."""
        if not len(rows):
            return
        self.newest = rows[-1:]
        self._tail = TrendRows.join([rows] if self._tail is None else [self._tail, rows])[-_TAIL:]
        self._keep(rows[-self._seen % self._stride :: self._stride])
        self._seen += len(rows)
        while self._kept > POINTS_MAX:
            whole = self.rows()
            self._rows, self._kept = [], 0
            self._keep(whole[::2])
            self._stride *= 2

    def rows(self) -> TrendRows:
        """The retained rows."""
        if len(self._rows) > 1:
            self._rows = [TrendRows.join(self._rows)]
        return self._rows[0]

    def known(self) -> TrendRows:
        """The retained rows, and all of the newest; some are in both."""
        return self.rows() if self._tail is None else TrendRows.join([self.rows(), self._tail])

    def plain(self, rows: TrendRows) -> list[dict[str, Any]]:
        """Rows as plain data for the page, one item for each parameter."""
        shared = {name: getattr(rows, name).tolist() for name in ("time_s", "schedule", "status")}
        return [
            {"model": self.model, "name": name, "unit": unit, "value": value.tolist(), "sigma": sigma.tolist()} | shared
            for name, unit, value, sigma in zip(self.names, self.units, rows.value.T, rows.sigma.T)
        ]

    def _keep(self, rows: TrendRows) -> None:
        if len(rows):
            self._rows.append(TrendRows.join([rows]))  # a copy
            self._kept += len(rows)
            if len(self._rows) > _TREND_PARTS_MAX:  # a one-row part takes several times the memory of its data
                self.rows()


class Trends:
    """The trends of one run. Parameters that arrive together are one trend: they share times and status."""

    def __init__(self) -> None:
        self.version = 0
        self._trends: dict[tuple[str, tuple[str, ...]], ModelTrend] = {}
        self._count = 0

    def add_parameters(self, parts: tuple[Parameters, ...]) -> None:
        """Add the published parameters of a run."""
        for part in parts:
            rows = TrendRows(part.time_s, part.schedule, part.value, part.sigma, part.status)
            self.add(part.model, part.names, part.units, rows)

    def add(self, model: str, names: Sequence[str], units: Sequence[str], rows: TrendRows) -> None:
        """Add rows of parameters of a model."""
        key = (model, tuple(names))
        if key not in self._trends:
            if self._count + len(names) > TRENDS_MAX:
                return
            self._trends[key] = ModelTrend(model, names, units)
            self._count += len(names)
        self._trends[key].add(rows)
        self.version += 1

    def moment(self, time_s: float, model: str, names: Sequence[str]) -> FitMoment:
        """What is shown of a time: the nearest valid fit of a model, and of every other trend the row of that fit.

        Trends without a row of that time have their nearest row with a value. `time_s` may be infinite: the newest.
        """
        known = [(trend, trend.known()) for trend in self._trends.values() if trend.newest is not None]
        time_s = min(time_s, max((float(rows.time_s[-1]) for _, rows in known), default=nan))
        columns = {
            name: (rows.time_s, rows.value[:, column])
            for trend, rows in known
            if trend.model == model
            for column, name in enumerate(trend.names)
        }
        chosen = [columns[name] for name in names if name in columns]
        fit_s, values = nan, None
        if chosen and len(chosen) == len(names) and all(len(times) == len(chosen[0][0]) for times, _ in chosen):
            of_names = np.stack([value for _, value in chosen], axis=1)
            row = _nearest(chosen[0][0], np.asarray(np.isfinite(of_names).all(axis=1)), time_s)
            if row is not None:
                fit_s, values = float(chosen[0][0][row]), of_names[row]
        plain = [item for trend, rows in known for item in trend.plain(_row(rows, fit_s, time_s))]
        return FitMoment(fit_s, values, plain)

    def plain(self, *, whole: bool) -> list[dict[str, Any]]:
        """Plain data for the page, one item for each parameter: all retained rows, or only the newest."""
        rows = [(trend, trend.rows() if whole else trend.newest) for trend in self._trends.values()]
        return [
            item for trend, some in rows if some is not None and trend.newest is not None for item in trend.plain(some)
        ]


@dataclass(frozen=True, eq=False)
class FitMoment:
    """Rows of the trends of a run that are shown together.

    Attributes
    ----------
    time_s
        Effective time of the fit of the drawn model; NaN if there is none.
    values
        Parameters of this fit; None if there is none.
    plain
        One row of every parameter, as plain data for the page.
    """

    time_s: float
    values: Floats | None
    plain: list[dict[str, Any]]


def _row(rows: TrendRows, fit_s: float, time_s: float) -> TrendRows:
    """The row of a fit; else the row with a value that is nearest to it, or to a time; else the nearest row."""
    same = np.flatnonzero(rows.time_s == fit_s)
    if same.size:
        row = int(same[-1])
        return rows[row : row + 1]
    near_s = time_s if np.isnan(fit_s) else fit_s
    known = np.asarray(np.isfinite(rows.value).any(axis=1))
    row = _nearest(rows.time_s, known | ~known.any(), near_s) or 0
    return rows[row : row + 1]


def _nearest(times_s: Floats, use: NDArray[np.bool_], time_s: float) -> int | None:
    """Index of the row in use that is nearest to a time, of equal ones the last; None if none is in use."""
    rows = np.flatnonzero(use)[::-1]
    if not rows.size:
        return None
    return int(rows[np.argmin(np.abs(times_s[rows] - time_s))])
