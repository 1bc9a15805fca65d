"""Trends: fitted parameters and margins over the whole run in bounded memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Parameters, RowArrays

POINTS_MAX = 1024
TRENDS_MAX = 256
_PARTS_MAX = 16


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

    def plain(self, *, whole: bool) -> list[dict[str, Any]]:
        """Plain data for the page, one item for each parameter: all retained rows, or only the newest."""
        rows = self.rows() if whole else self.newest
        assert rows is not None
        shared = {name: getattr(rows, name).tolist() for name in ("time_s", "schedule", "status")}
        return [
            {"model": self.model, "name": name, "unit": unit, "value": value.tolist(), "sigma": sigma.tolist()} | shared
            for name, unit, value, sigma in zip(self.names, self.units, rows.value.T, rows.sigma.T)
        ]

    def _keep(self, rows: TrendRows) -> None:
        if len(rows):
            self._rows.append(TrendRows.join([rows]))  # a copy
            self._kept += len(rows)
            if len(self._rows) > _PARTS_MAX:  # a one-row part takes several times the memory of its data
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

    def values(self, model: str, names: Sequence[str], *, whole: bool) -> tuple[Floats, Floats] | None:
        """Times, and values (rows, names), of all retained rows or of the newest; None if a name or row is missing."""
        columns = {
            name: (rows.time_s, rows.value[:, at])
            for trend in self._trends.values()
            if trend.model == model and trend.newest is not None
            for rows in [trend.rows() if whole else trend.newest]
            for at, name in enumerate(trend.names)
        }
        found = [columns[name] for name in names if name in columns]
        if len(found) < len(names) or any(len(time_s) != len(found[0][0]) for time_s, _ in found):
            return None
        return found[0][0], np.stack([value for _, value in found], axis=1)

    def plain(self, *, whole: bool) -> list[dict[str, Any]]:
        """Plain data for the page; see `ModelTrend.plain`."""
        return [one for trend in self._trends.values() if trend.newest is not None for one in trend.plain(whole=whole)]
