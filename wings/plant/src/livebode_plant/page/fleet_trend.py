"""AxisTrends: what the lake of a fleet has of an axis over the last year, for its page."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import reduce
from itertools import combinations
from operator import and_, or_
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import LEVELS, ServerError
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode_plant.fleet.main_quantity import STIFFNESS

if TYPE_CHECKING:
    from livebode_plant.lake import Lake
    from livebode_plant.trending import Trend

POINTS_MAX = 1000
"""Points of a picture; more are joined to medians."""
QUANTITIES_MAX = 64
READ_S = 8.0
"""A lake that answers slowly is read for so long, from the newest day on."""
REMEMBERED_S = 60.0
_AXES_REMEMBERED = 8
_HOURS_FEW = 24
"""With fewer means over an hour, those over a minute of the last day are shown too."""
_SPAN = timedelta(days=366)
_MINUTE_S, _DAY_S = 60.0, 86400.0
_OF_FITS = ["model", "name", "unit", "value", "bound_95", "low", "high", "recipe"]
_NUMBERS = ("at", "value", "bound_95", "low", "high")


class QuantityName(NamedTuple):
    """A quantity of an axis."""

    model: str
    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class QuantityYear:
    """A quantity of an axis over the last year, in the order of time, arrays (n,).

    Attributes
    ----------
    at
        Seconds since 1970.
    value, bound_95, low, high
        Median of the fits of an hour, a minute or a run, 95 % bound of one fit, 5 % and 95 % quantile.
    others
        Whether it was computed with other settings than most: values of different settings are no trend.
    """

    at: Floats
    value: Floats
    bound_95: Floats
    low: Floats
    high: Floats
    others: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: pa.Table) -> QuantityYear:
        """The rows of a quantity in any order."""
        rows = rows.sort_by("at")
        recipes = rows["recipe"].to_pylist()
        most = max(set(recipes), key=recipes.count)
        at, value, bound_95, low, high = (rows[name].to_numpy() for name in _NUMBERS)
        return cls(at, value, bound_95, low, high, np.array([recipe != most for recipe in recipes]))

    def joined(self, period_s: float) -> QuantityYear:
        """One point for each period and kind of settings: medians, from the lowest quantile to the highest."""
        period = np.floor(self.at / period_s).astype(np.int64)
        groups = np.unique(2 * period + self.others, return_inverse=True)[1]
        order = np.argsort(groups, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(groups[order])) + 1)
        return QuantityYear(
            np.array([np.median(self.at[part]) for part in parts]),
            np.array([np.median(self.value[part]) for part in parts]),
            np.array([np.median(self.bound_95[part]) for part in parts]),  # the model's error is in each of them
            np.array([self.low[part].min() for part in parts]),
            np.array([self.high[part].max() for part in parts]),
            np.array([self.others[part[0]] for part in parts]),
        )

    def thinned(self) -> QuantityYear:
        """At most `POINTS_MAX` points."""
        found, period_s = self, _MINUTE_S * np.ceil((self.at[-1] - self.at[0]) / _MINUTE_S / POINTS_MAX)
        while len(found.at) > POINTS_MAX:
            found, period_s = self.joined(period_s), 2 * period_s
        return found

    def trend(self) -> tuple[Trend | None, int]:
        """The trend of the medians of each day, None if there is too little for one; and the number of these days."""
        from livebode_plant.trending import Trend, trend_of

        days = self.joined(_DAY_S)
        own = ~days.others
        trend = trend_of(days.at[own], days.value[own], days.bound_95[own])
        return (trend if isinstance(trend, Trend) else None), int(own.sum())


@dataclass(eq=False)
class AxisYear:
    """All quantities of an axis; `stopped` if there was no time to read earlier values.

    `damaged` are the files of the lake that were left out; which axes they have is not known.
    """

    quantities: dict[QuantityName, QuantityYear]
    stopped: bool
    damaged: list[str]

    def plain(self, wanted: str, main: str) -> dict[str, Any]:
        """The picture of a quantity, `model:name`, or else of the one that the page names, for JSON.

        Raises
        ------
        ServerError
            If the lake has no such quantity of the axis.
        """
        if not self.quantities:
            return {"state": "no values", "stopped": self.stopped, "damaged": self.damaged}
        from livebode_plant.trending import RUNS_MIN

        names = sorted(self.quantities, key=lambda name: _rank(name, main))[:QUANTITIES_MAX]
        chosen = next((name for name in names if f"{name.model}:{name.name}" == wanted), None) if wanted else names[0]
        if chosen is None:
            raise ServerError(
                "request-malformed", "the lake has no such quantity of this axis", Message("reload the page")
            )
        year = self.quantities[chosen]
        shown, (trend, days) = year.thinned(), year.trend()
        return {
            "state": "shown",
            "quantities": names,
            "chosen": names.index(chosen),
            "points": list(zip(*(getattr(shown, name).tolist() for name in (*_NUMBERS, "others")))),
            "days": days,
            "days_min": RUNS_MIN,
            "trend": None if trend is None else _trend(trend),
            "stopped": self.stopped,
            "damaged": self.damaged,
        }


class AxisTrends:
    """Reads the means of a fleet and the runs of an archive from one lake; a request within a minute reads nothing.

    One thread at a time.

    Parameters
    ----------
    url
        The lake; empty if there is none.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._lake: Lake | None = None
        self._known: OrderedDict[str, tuple[float, AxisYear]] = OrderedDict()

    def plain(self, axis: str, quantity: str, main: str) -> dict[str, Any]:
        """The last year of an axis for JSON; see `AxisYear.plain`.

        Raises
        ------
        ArchiveError, LocationError, ExtraError
            If the lake cannot be read.
        ServerError
            If it has no such quantity of the axis.
        """
        if not self._url:
            return {"state": "no lake"}
        read_s, year = self._known.pop(axis, (-REMEMBERED_S, None))
        if year is None or time.monotonic() - read_s >= REMEMBERED_S:
            year, read_s = self._read(axis), time.monotonic()
        self._known[axis] = read_s, year
        while len(self._known) > _AXES_REMEMBERED:
            self._known.popitem(last=False)
        return year.plain(quantity, main)

    def _read(self, axis: str) -> AxisYear:
        from livebode_plant.lake import Lake

        self._lake = self._lake or Lake(self._url)
        now, where = datetime.now(UTC), _rows_of(axis)
        reading = _Reading(self._lake, where, time.monotonic() + READ_S)
        parts = [*reading.means("hour", now - _SPAN)]
        if sum(len(pc.unique(part["at"])) for part in parts) < _HOURS_FEW:
            parts += reading.means("minute", now - timedelta(days=1))
        parts.append(_runs(self._lake, where, now - _SPAN))
        rows = pa.concat_tables(parts)
        rows = rows.filter(pc.and_(pc.is_finite(rows["value"]), pc.is_finite(rows["bound_95"])))
        names = rows.group_by(list(QuantityName._fields)).aggregate([]).to_pylist()
        quantities = {QuantityName(**name): QuantityYear.of(rows.filter(_alike(name))) for name in names}
        return AxisYear(quantities, reading.stopped, self._lake.damaged)


@dataclass
class _Reading:
    """Reads the tables of a fleet until a deadline; `stopped` if that came before the end."""

    lake: Lake
    where: pc.Expression
    deadline_s: float
    stopped: bool = False

    def means(self, tier: str, since: datetime) -> Iterator[pa.Table]:
        """The means over an hour or a minute."""
        from livebode_plant.lake import StreamTable

        where = self.where & (pc.field("logged_from") >= pa.scalar(since, pa.timestamp("us", tz="UTC")))
        table = StreamTable(self.lake, f"fleet_parameters_{tier}")
        for part in table.newest_first([*_OF_FITS, "logged_from"], where, since.date()):
            if time.monotonic() > self.deadline_s:
                self.stopped = True
                return
            yield _dated(part, "logged_from")


def _runs(lake: Lake, where: pc.Expression, since: datetime) -> pa.Table:
    """The runs of an archive in the same lake that count."""
    later = where & (pc.field("recorded_from") >= pa.scalar(since, pa.timestamp("us", tz="UTC")))
    return _dated(lake.counted("quantities", [*_OF_FITS, "content", "recorded_from"], later, where), "recorded_from")


def _dated(rows: pa.Table, column: str) -> pa.Table:
    """The columns of fits, and the time in seconds since 1970."""
    time_s = pc.divide(rows[column].cast(pa.int64()).cast(pa.float64()), 1e6)
    return rows.select(_OF_FITS).append_column("at", time_s)


def _rows_of(axis: str) -> pc.Expression:
    """The rows of the axis with this path, in which levels without a name are left out."""
    names = axis.split("/")
    places = [dict(zip(some, names)) for some in combinations(LEVELS, len(names))]
    return reduce(or_, (reduce(and_, (_named(level, place.get(level)) for level in LEVELS)) for place in places), _NONE)


_NONE = pc.scalar(False)


def _named(level: str, name: str | None) -> pc.Expression:
    return pc.field(level).is_null() if name is None else pc.field(level) == name


def _alike(name: dict[str, str]) -> pc.Expression:
    return reduce(and_, (pc.field(name) == text for name, text in name.items()))


def _rank(one: QuantityName, main: str) -> tuple[bool, bool, bool, str, str]:
    """The quantity of the tile first, then stiffnesses and resonances."""
    return one.name != main, one.unit not in STIFFNESS, not one.name.startswith("resonance"), one.name, one.model


def _trend(trend: Trend) -> dict[str, Any]:
    line = zip(trend.time_s.tolist(), trend.line.tolist(), trend.line_bound_95.tolist())
    percent = trend.relative if np.isfinite(trend.relative) else None
    return {
        "line": list(line),
        "per_month": trend.per_month,
        "bound_95": trend.per_month_bound_95,
        "percent": percent,
        "since_s": trend.slope_since_s,
    }
