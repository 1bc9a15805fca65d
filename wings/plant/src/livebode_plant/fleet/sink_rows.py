"""SinkRows: a message of results as rows of the lake."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from livebode.core import LEVELS
from livebode.dataclass import dataclass
from livebode.tables import from_numpy, to_numpy
from livebode_plant.fleet.reader import StoredMessage
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.subjects import axis_names
from livebode_plant.lake import TABLES

US = 1_000_000
DELETED = "results-deleted"
"""Kind of the event that gives the extent of what the log deleted before it was read."""


class RunKey(NamedTuple):
    """A run of an axis: key of the axis, number of the run's first message in the log, and id of the recipe."""

    axis: str
    run: int
    recipe: str


class RunPart(NamedTuple):
    """Consecutive rows of one run, and when the log received what each was computed from, µs since 1970, (rows,)."""

    key: RunKey
    rows: pa.Table
    logged_us: NDArray[np.int64]


@dataclass(frozen=True)
class SinkRows:
    """The content of a message of results.

    Attributes
    ----------
    number, stored_s
        Of the message in its stream.
    tables
        Rows for tables of the lake, by name.
    responses, parameters
        The same, run by run.
    grids
        Lines of each run, as the entry ``found`` of run.json.
    """

    number: int
    stored_s: float
    tables: Mapping[str, pa.Table]
    responses: Sequence[RunPart]
    parameters: Sequence[RunPart]
    grids: Mapping[tuple[str, int], Mapping[str, Any]]


def sink_rows(message: StoredMessage, log: str) -> SinkRows:
    """The rows of a message; `log` names the log in them.

    Raises
    ------
    FleetError
        If another version of livebode wrote it in another form.
    """
    result = ResultMessage.from_bytes(message.data)
    # The clocks of two servers of a cluster differ: nothing is stored before it was logged.
    logged_s = {key: min(at_s, message.stored_s) for key, at_s in result.logged_s.items()}
    responses, parameters = (
        _Results(rows, result.recipes, logged_s, message.stored_s) for rows in (result.rows, result.parameters)
    )
    tables = {
        "fleet_responses": responses.table("fleet_responses", log),
        "fleet_parameters": parameters.table("fleet_parameters", log),
        "fleet_events": event_rows(result.events, result.recipes, logged_s, message.stored_s, log),
    }
    parts = list(responses.parts())
    grids = {(key.axis, key.run): result.grids[key.axis] for key, _, _ in parts}
    return SinkRows(message.number, message.stored_s, tables, parts, list(parameters.parts()), grids)


def event_rows(
    events: Sequence[Mapping[str, Any]],
    recipes: Mapping[str, str],
    logged_s: Mapping[str, float],
    stored_s: float,
    log: str,
) -> pa.Table:
    """Rows of events; those without an axis belong to the log."""
    rows = []
    for event in events:
        key = event.get("axis", "")
        own = {name: event.get(name) for name in ("kind", "sample", "time_s", "message")}
        own["details"] = json.dumps(event.get("details", {}), ensure_ascii=False)
        place = run_place(key, event.get("run"), recipes.get(key), log)
        rows.append(place | own | dated("logged", logged_s.get(key, stored_s)))
    return pa.Table.from_pylist(rows, TABLES["fleet_events"].schema)


def run_rows(runs: Mapping[RunKey, Mapping[str, Any]], logged_s: Mapping[RunKey, float], log: str) -> pa.Table:
    """Rows of runs, from the grid of each and when its first response was logged."""
    rows = []
    for key, grid in runs.items():
        own = {name: grid[name] for name in ("rate_hz", "window", "quantity", "unit", "bins", "quiet_bins")}
        own["frequencies_hz"] = [k * grid["rate_hz"] / grid["window"] for k in grid["bins"]]
        rows.append(run_place(*key, log) | own | dated("logged", logged_s[key]))
    return pa.Table.from_pylist(rows, TABLES["fleet_runs"].schema)


def run_place(axis: str, run: int | None, recipe: str | None, log: str) -> dict[str, Any]:
    """Columns of the run that a row belongs to; without an axis those of the log."""
    return dict(zip(LEVELS, axis_names(axis) if axis else ())) | {"log": log, "run": run, "recipe": recipe}


def dated(column: str, time_s: float) -> dict[str, Any]:
    """The column with this time of the log, and the day that the row is stored in."""
    time = datetime.fromtimestamp(time_s, UTC)
    return {column: time, "day": time.date()}


class _Results:
    """A table of a message, whose rows belong to axes."""

    def __init__(
        self, rows: pa.Table, recipes: Mapping[str, str], logged_s: Mapping[str, float], stored_s: float
    ) -> None:
        coded = rows["axis"].combine_chunks().dictionary_encode()
        self._rows, self._codes = rows, to_numpy(coded.indices)
        self._keys: list[str] = coded.dictionary.to_pylist()
        self._recipes = [recipes.get(key, "") for key in self._keys]
        logged = np.array([logged_s.get(key, stored_s) for key in self._keys], np.float64)
        self._logged_us = np.rint(logged * US).astype(np.int64)[self._codes]

    def table(self, name: str, log: str) -> pa.Table:
        """The rows for a table of the lake."""
        schema = TABLES[name].schema
        logged = from_numpy(self._logged_us).cast(pa.timestamp("us", tz="UTC"))
        names = list(zip(*map(axis_names, self._keys))) or [()] * len(LEVELS)
        own: dict[str, pa.Array[Any]] = {level: self._each(words) for level, words in zip(LEVELS, names)}
        own |= {"recipe": self._each(self._recipes), "log": pa.repeat(pa.scalar(log, pa.string()), len(self._codes))}
        own |= {"logged": logged, "day": logged.cast(pa.timestamp("us")).cast(pa.date32())}
        every = {name: self._rows[name] for name in self._rows.column_names} | own
        columns = [every[field.name].cast(field.type) for field in schema]
        return pa.table(columns, schema=schema)

    def parts(self) -> Iterator[RunPart]:
        """Consecutive rows of one run."""
        runs = to_numpy(self._rows["run"].combine_chunks())
        ends = np.flatnonzero((np.diff(self._codes) != 0) | (np.diff(runs) != 0)) + 1
        for first, stop in pairwise([0, *ends.tolist(), len(runs)]):
            if stop > first:
                code = self._codes[first]
                key = RunKey(self._keys[code], int(runs[first]), self._recipes[code])
                yield RunPart(key, self._rows.slice(first, stop - first), self._logged_us[first:stop])

    def _each(self, words: Sequence[str | None]) -> pa.Array[Any]:
        """The word of the axis in each row."""
        return pa.array(words, pa.string()).take(from_numpy(self._codes))
