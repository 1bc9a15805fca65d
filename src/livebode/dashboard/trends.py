"""Trends: fitted parameters and margins over the whole run in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Parameters, RowArrays

Floats = NDArray[np.float64]

POINTS_MAX = 1024
TRENDS_MAX = 256
_PARTS_MAX = 16


@dataclass(frozen=True, eq=False)
class TrendRows(RowArrays):
    """One parameter over time, arrays of equal length."""

    time_s: Floats
    schedule: Floats
    value: Floats
    sigma: Floats
    status: NDArray[Any]


class ParameterTrend:
    """Every n-th row of one parameter, with n doubled whenever there are too many, and the newest row."""

    def __init__(self, model: str, name: str, unit: str) -> None:
        self.model, self.name, self.unit = model, name, unit
        self.newest: TrendRows | None = None
        self._rows: list[TrendRows] = []
        self._seen, self._stride, self._kept = 0, 1, 0

    def add(self, rows: TrendRows) -> None:
        """Append rows."""
        if not len(rows):
            return
        self.newest = rows[-1:]
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

    def plain(self, *, whole: bool) -> dict[str, Any]:
        """Plain data for the page: all retained rows, or only the newest."""
        rows = self.rows() if whole else self.newest
        assert rows is not None
        found = {"model": self.model, "name": self.name, "unit": self.unit}
        return found | {name: array.tolist() for name, array in vars(rows).items()}

    def _keep(self, rows: TrendRows) -> None:
        if len(rows):
            self._rows.append(TrendRows.join([rows]))  # a copy
            self._kept += len(rows)
            if len(self._rows) > _PARTS_MAX:  # a one-row part takes ten times the memory of its data
                self.rows()


class Trends:
    """The trends of one run, by model and name."""

    def __init__(self) -> None:
        self.by_name: dict[tuple[str, str], ParameterTrend] = {}
        self.version = 0

    def take(self, parts: tuple[Parameters, ...]) -> None:
        """Take the published parameters of a run."""
        for part in parts:
            sigma = part.sigma
            for i, (name, unit) in enumerate(zip(part.names, part.units)):
                rows = TrendRows(part.time_s, part.schedule, part.value[:, i], sigma[:, i], part.status)
                self.add(part.model, name, unit, rows)

    def add(self, model: str, name: str, unit: str, rows: TrendRows) -> None:
        """Take rows of one parameter."""
        key = (model, name)
        if key not in self.by_name:
            if len(self.by_name) >= TRENDS_MAX:
                return
            self.by_name[key] = ParameterTrend(model, name, unit)
        self.by_name[key].add(rows)
        self.version += 1

    def plain(self, *, whole: bool) -> list[dict[str, Any]]:
        """Plain data for the page; see `ParameterTrend.plain`."""
        return [trend.plain(whole=whole) for trend in self.by_name.values() if trend.newest is not None]
