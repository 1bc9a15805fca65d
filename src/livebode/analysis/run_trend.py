"""One run as points of a trend over many runs: its fitted quantities and margins, and its alarms."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from livebode.analysis.parameter_track import MARGINS
from livebode.core import Event
from livebode.core.parameters import OK
from livebode.records import RunRecord

Floats = NDArray[np.float64]

ALARMS = ("change", "change-corrected", "baseline-unknown")
"""Kinds of the events that are alarms of the monitoring."""
_BOUND_95 = 1.959964
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
        at = int(np.argmin(np.abs(value - middle)))
        low, high = (float(x) for x in np.quantile(value, (0.05, 0.95)))
        bound = _BOUND_95 * float(np.median(sigma))
        return TrendPoint(
            self.model, self.name, self.unit, middle, bound, low, high, float(time_s[at]), self._seen
        )  # fmt: skip

    def shown(self) -> tuple[Floats, Floats, Floats]:
        """Times, values and 95 % bounds of at most 120 of them."""
        rows = self.rows
        time_s, value, sigma = rows[:: max(1, -(-len(rows) // _ROWS_SHOWN))].T
        return time_s, value, _BOUND_95 * sigma


def fitted_rows(run: RunRecord) -> list[QuantityRows]:
    """The valid fits of each quantity that is not fixed, margins included; of a run in segments the newest 64 MiB."""
    found: dict[tuple[str, str], QuantityRows] = {}
    for table in run.tables("parameters", _NEWEST_BYTES):
        add_fits(found, table)
    return list(found.values())


def add_fits(found: dict[tuple[str, str], QuantityRows], table: pa.Table) -> None:
    """Add the valid fits of each quantity that is not fixed, from rows of parameters.parquet, to its model and name."""
    columns = {name: table[name].to_numpy(zero_copy_only=False) for name in ("time_s", "value", "sigma")}
    rows = np.column_stack([columns[name].astype(np.float64) for name in columns])
    valid = (table["status"].to_numpy(zero_copy_only=False) == OK) & np.isfinite(rows).all(axis=1) & (rows[:, 2] > 0)
    coded = [table[name].combine_chunks().dictionary_encode() for name in ("model", "name", "unit")]
    models, names, units = (column.dictionary.to_pylist() for column in coded)
    model, name, unit = (column.indices.to_numpy(zero_copy_only=False) for column in coded)
    both = np.where(valid, model * len(names) + name, -1)
    for code in np.unique(both[both >= 0]).tolist():
        here = np.flatnonzero(both == code)
        key = models[code // len(names)], names[code % len(names)]
        quantity = found.get(key) or QuantityRows(*key, units[unit[here[0]]])
        found[key] = quantity
        quantity.add(rows[here])


def trend_points(run: RunRecord) -> list[TrendPoint]:
    """The run as one point for each of its quantities; margins from run.json where they were not recorded live."""
    found = [quantity.point for quantity in fitted_rows(run)]
    if any(point.model == MARGINS for point in found):
        return found
    loop, newest = run.summary.get("loop", {}), run.summary.get("fit", {}).get("newest", {})
    for name, margin in (loop.get("margins") or {}).items():
        value, bound, time_s = margin.get("value"), margin.get("bound_95"), newest.get("time_s")
        if all(isinstance(x, int | float) and isfinite(x) for x in (value, bound, time_s)):
            unit = str(margin.get("unit", ""))
            found.append(TrendPoint(MARGINS, str(name), unit, value, bound, value, value, time_s, 1))
    return found


def alarms_of(run: RunRecord) -> list[Event]:
    """The newest 50 alarms of the monitoring."""
    return list(deque(_alarms(run), _ALARMS_MAX))


def _alarms(run: RunRecord) -> Iterator[Event]:
    return (event for event in run.each_event() if event.kind in ALARMS and isfinite(event.time_s))
