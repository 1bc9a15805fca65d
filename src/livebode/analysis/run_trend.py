"""One run as points of a trend over many runs: its fitted quantities and margins, and its alarms."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import field
from math import isfinite
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR, OK, Event
from livebode.dataclass import dataclass
from livebode.records import RunRecord
from livebode.tables import Table

MARGINS = "margins"
"""Model of the rows of a record that are margins."""
ALARMS = ("change", "change-corrected", "baseline-unknown")
"""Kinds of the events that are alarms of the monitoring."""
_ALARMS_MAX, _ROWS_MAX, _ROWS_SHOWN = 50, 2048, 120
_NEWEST_BYTES = 64 << 20


@dataclass(frozen=True)
class TrendPoint:
    """A quantity of a run as one point.

    Attributes
    ----------
    value
        Median of the valid fits of the run.
    bound_95
        95 % bound of one fit, the median over them. It is not divided by √n: the model's error is in every fit of a
        run, and windows overlap.
    low, high
        5 % and 95 % quantile of the fits: the variation within the run, such as that over the position.
    time_s
        Effective time of the fit nearest to the median.
    fits
        Number of valid fits.
    """

    model: str
    name: str
    unit: str
    value: float
    bound_95: float
    low: float
    high: float
    time_s: float
    fits: int


@dataclass(eq=False)
class QuantityRows:
    """Valid fits of a quantity over a run, each n-th, at most 2,048: times in s, values and standard deviations."""

    model: str
    name: str
    unit: str
    _parts: list[Floats] = field(default_factory=list)
    _stride: int = 1
    _seen: int = 0

    def add(self, rows: Floats) -> None:
        """Add rows of time, value and sigma, shape (n, 3)."""
        self._parts.append(rows[-self._seen % self._stride :: self._stride])
        self._seen += len(rows)
        while sum(map(len, self._parts)) > _ROWS_MAX:
            self._parts = [np.concatenate(self._parts)[::2]]
            self._stride *= 2

    @property
    def rows(self) -> Floats:
        """Time, value and sigma, shape (n, 3)."""
        return np.concatenate(self._parts)

    @property
    def point(self) -> TrendPoint:
        """The run as one point."""
        time_s, value, sigma = self.rows.T
        middle = float(np.median(value))
        row = int(np.argmin(np.abs(value - middle)))
        low, high = (float(x) for x in np.quantile(value, (0.05, 0.95)))
        bound = INTERVAL_FACTOR * float(np.median(sigma))
        return TrendPoint(
            self.model, self.name, self.unit, middle, bound, low, high, float(time_s[row]), self._seen
        )  # fmt: skip

    def shown(self) -> tuple[Floats, Floats, Floats]:
        """Times, values and 95 % bounds of at most 120 of them."""
        rows = self.rows
        time_s, value, sigma = rows[:: max(1, -(-len(rows) // _ROWS_SHOWN))].T
        return time_s, value, INTERVAL_FACTOR * sigma


class FittedQuantities:
    """The valid fits of each quantity that is not fixed, margins included, from tables of parameters as they come."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], QuantityRows] = {}

    def add(self, table: Table) -> None:
        """Add rows as in parameters.parquet."""
        rows = np.column_stack([table[name] for name in ("time_s", "value", "sigma")])
        coded = [table.text(name) for name in ("model", "name", "unit")]
        (models, names, units), (model, name, unit) = ([text.words for text in coded], [text.at for text in coded])
        valid = table.text("status").where(OK) & np.isfinite(rows).all(axis=1) & (rows[:, 2] > 0)
        both = np.where(valid, model * len(names) + name, -1)
        for code in np.unique(both[both >= 0]).tolist():
            here = np.flatnonzero(both == code)
            key = models[code // len(names)], names[code % len(names)]
            quantity = self._found.get(key) or QuantityRows(*key, units[unit[here[0]]])
            self._found[key] = quantity
            quantity.add(rows[here])

    @property
    def quantities(self) -> list[QuantityRows]:
        """Quantities with a valid fit."""
        return list(self._found.values())

    def points(self, summary: Mapping[str, Any]) -> list[TrendPoint]:
        """The run as one point for each; margins from run.json where they were not recorded live."""
        points = [quantity.point for quantity in self.quantities]
        if any(point.model == MARGINS for point in points):
            return points
        loop, newest = summary.get("loop", {}), summary.get("fit", {}).get("newest", {})
        for name, margin in (loop.get("margins") or {}).items():
            value, bound, time_s = margin.get("value"), margin.get("bound_95"), newest.get("time_s")
            if all(isinstance(x, int | float) and isfinite(x) for x in (value, bound, time_s)):
                unit = str(margin.get("unit", ""))
                points.append(TrendPoint(MARGINS, str(name), unit, value, bound, value, value, time_s, 1))
        return points


def fitted_rows(run: RunRecord) -> FittedQuantities:
    """The valid fits of a run: the newest 64 MiB."""
    quantities = FittedQuantities()
    for table in run.tables("parameters", _NEWEST_BYTES):
        quantities.add(table)
    return quantities


def trend_points(run: RunRecord) -> list[TrendPoint]:
    """The run as one point for each of its quantities; see `FittedQuantities.points`."""
    return fitted_rows(run).points(run.summary)


def alarms_of(run: RunRecord) -> list[Event]:
    """The newest 50 alarms of the monitoring."""
    return list(deque(_alarms(run), _ALARMS_MAX))


def _alarms(run: RunRecord) -> Iterator[Event]:
    return (event for event in run.each_event() if event.kind in ALARMS and isfinite(event.time_s))
