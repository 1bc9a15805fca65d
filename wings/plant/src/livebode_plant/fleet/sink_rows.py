"""SinkRows: a message of results as rows of the lake."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from livebode.core import LEVELS
from livebode.tables import from_numpy, to_numpy
from livebode_plant.fleet.log import StoredMessage
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.subjects import axis_names
from livebode_plant.lake import FLEET_EVENTS, FLEET_PARAMETERS, FLEET_RESPONSES, FLEET_RUNS

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
        "fleet_responses": responses.table(FLEET_RESPONSES, log),
        "fleet_parameters": parameters.table(FLEET_PARAMETERS, log),
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
    found = []
    for event in events:
        key = event.get("axis", "")
        logged = datetime.fromtimestamp(logged_s.get(key, stored_s), UTC)
        own = {name: event.get(name) for name in ("run", "kind", "sample", "time_s", "message")}
        found.append(
            own
            | (dict(zip(LEVELS, axis_names(key))) if key else {})
            | {"log": log, "recipe": recipes.get(key), "logged": logged, "day": logged.date()}
            | {"details": json.dumps(event.get("details", {}), ensure_ascii=False)}
        )
    return pa.Table.from_pylist(found, FLEET_EVENTS)


def run_rows(runs: Mapping[RunKey, Mapping[str, Any]], logged_s: Mapping[RunKey, float], log: str) -> pa.Table:
    """Rows of runs, from the grid of each and when its first response was logged."""
    found = []
    for key, grid in runs.items():
        logged = datetime.fromtimestamp(logged_s[key], UTC)
        own = {name: grid[name] for name in ("rate_hz", "window", "quantity", "unit", "bins", "quiet_bins")}
        place = dict(zip(LEVELS, axis_names(key.axis)))
        frequencies = [k * grid["rate_hz"] / grid["window"] for k in grid["bins"]]
        about = {"log": log, "run": key.run, "recipe": key.recipe, "logged": logged, "day": logged.date()}
        found.append(own | place | about | {"frequencies_hz": frequencies})
    return pa.Table.from_pylist(found, FLEET_RUNS)


def mean_place(key: RunKey, begin_us: int, log: str) -> dict[str, Any]:
    """The columns of a row of means that say to what it belongs."""
    begin = datetime.fromtimestamp(begin_us / US, UTC)
    about = {"log": log, "run": key.run, "recipe": key.recipe, "logged_from": begin, "day": begin.date()}
    return dict(zip(LEVELS, axis_names(key.axis))) | about


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

    def table(self, schema: pa.Schema, log: str) -> pa.Table:
        """The rows for the lake."""
        logged = from_numpy(self._logged_us).cast(pa.timestamp("us", tz="UTC"))
        names = list(zip(*map(axis_names, self._keys))) or [()] * len(LEVELS)
        own: dict[str, pa.Array[Any]] = {level: self._each(words) for level, words in zip(LEVELS, names)}
        own |= {"recipe": self._each(self._recipes), "log": pa.repeat(pa.scalar(log, pa.string()), len(self._codes))}
        own |= {"logged": logged, "day": logged.cast(pa.timestamp("us")).cast(pa.date32())}
        columns = [(own[one.name] if one.name in own else self._rows[one.name]).cast(one.type) for one in schema]
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
