"""A run that another process recorded, or is recording: read from its directory."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Event, Responses
from livebode.dashboard.hub import Item
from livebode.dashboard.matrix_group import MatrixGroup
from livebode.dashboard.recent import TrendRows
from livebode.dashboard.state import State
from livebode.estimates import kind_of, rule
from livebode.records import RunRecord, read_summary, still_waiting, thinned

_LONG_BYTES = 16 << 20  # larger tables are not read whole
_MEANS = 2000
_RECENT_S = 600.0


class RunFeed:
    """Passes the responses, parameters and events of a run directory, or of an entry of a matrix run, to a State."""

    def __init__(self, directory: Path, entry: str | None = None) -> None:
        self.directory, self._entry = directory, entry
        self._run = RunRecord.open(directory, entry=entry)
        self._sample = self._parameter_sample = -1
        self._last_s = -inf
        self._events = 0
        self._damages: list[Event] = []

    @property
    def finished(self) -> bool:
        """Whether no more data will follow."""
        return self._run.finished

    def fill(self, state: State) -> None:
        """Pass all data to the state."""
        self.begin(state)
        if not self.fill_from_means(state):
            for part in self._run.batches():
                self.pass_new(state, part)
        self.rest(state)

    def begin(self, state: State) -> None:
        """Start the run of the state; its responses follow by `pass_new`, and then everything else by `rest`."""
        state.begin(self.directory, self._run.summary)

    def fill_from_means(self, state: State) -> bool:
        """Pass the means of a long run and its newest responses; False if the run is short, or has no means."""
        segments = [segment for segment in self._run.segments if segment.table == "responses"]
        if sum(segment.size_bytes for segment in segments) < _LONG_BYTES:
            return False
        newest_s = segments[-1].last_s
        means = thinned(self._run, (newest_s - segments[0].first_s) / _MEANS)
        if means is None:
            return False
        first = next(self._run.between(-inf, segments[0].first_s))
        newest = Responses.join(list(self._run.between(newest_s - _RECENT_S, inf)))
        each = len(self._run.lines) * (1 if state.group is None else len(state.group.entries))
        count = sum(segment.rows for segment in segments) // each
        count += int(np.count_nonzero(newest.time_s > newest_s))
        self._sample, self._last_s = int(newest.sample[-1]), float(newest.time_s[-1])
        state.add_past(first, means, newest, count)
        return True

    def more(self) -> tuple[list[Item], list[tuple[str, str, str, TrendRows]], dict[str, Any], bool]:
        """Pass new data: responses and events, rows of parameters, run.json, and whether the run has ended."""
        self._run = RunRecord.open(self.directory, entry=self._entry)
        behind_s = self._last_s, inf  # earlier segments are not read again
        items: list[Item] = [new for part in self._run.between(*behind_s) if (new := self._new(part)) is not None]
        rows = list(self._parameters(behind_s))
        items += self._new_events()
        return items, rows, self._run.summary, self._run.ended

    def rest(self, state: State) -> None:
        """Pass parameters and events."""
        for model, name, unit, rows in self._parameters(None):
            state.trends.add(model, [name], [unit], rows)
        state.add(list(self._new_events()))
        state.finished = self._run.ended
        state.read()

    def _new_events(self) -> list[Event]:
        written, waiting = self._run.event_lines()
        lines = list(written)
        new = list(still_waiting(lines, waiting))[self._events :]
        self._events = len(lines)
        for damage in self._run.damages:
            if damage not in (*self._damages, *new):
                new.append(damage)
        self._damages = self._run.damages
        return new

    def pass_new(self, state: State, part: Responses) -> None:
        """Pass responses that are new."""
        if (new := self._new(part)) is not None:
            state.add([new])

    def _new(self, part: Responses) -> Responses | None:
        behind = np.flatnonzero(part.sample > self._sample)
        if not behind.size:
            return None
        self._sample, self._last_s = int(part.sample[-1]), float(part.time_s[-1])
        return part[behind]

    def _parameters(self, span_s: tuple[float, float] | None) -> Iterator[tuple[str, str, str, TrendRows]]:
        """Model, name, unit and rows of each parameter, table by table."""
        for table in self._run.tables("parameters", span_s=span_s):
            new = table["sample"] > self._parameter_sample
            if not new.any():
                continue
            self._parameter_sample = int(table["sample"][-1])
            column = {name: table.values(name)[new] for name in ("time_s", "schedule", "value", "sigma", "status")}
            model, name, unit = (table.text(c)[new] for c in ("model", "name", "unit"))
            both = model.at * len(name.words) + name.at
            _, first = np.unique(both, return_index=True)
            for row in np.sort(first).tolist():
                use = both == both[row]
                columns = {c: x[use] for c, x in column.items()}
                rows = TrendRows(**columns | {c: columns[c][:, np.newaxis] for c in ("value", "sigma")})
                yield model[row], name[row], unit[row], rows


def views_of(directory: Path, first_axis: int = 0) -> list[tuple[State, RunFeed]]:
    """The states of a run with all its data; LivebodeError if it cannot be read."""
    summary, _ = read_summary(directory)
    page = rule(kind_of(summary), "page") or views_of_response  # which says why there is none
    return page(directory, directory.resolve().name, first_axis)


def views_of_response(directory: Path, name: str, first_axis: int) -> list[tuple[State, RunFeed]]:
    """The only axis of a run with single responses."""
    state, viewed = State(name, first_axis), RunFeed(directory)
    viewed.fill(state)
    return [(state, viewed)]


def views_of_matrix(directory: Path, name: str, first_axis: int) -> list[tuple[State, RunFeed]]:
    """All entries: of a long run from its means, else from one reading of the matrices."""
    run = RunRecord.open(directory, matrix=True)
    settings = run.summary["found"]
    group = MatrixGroup(name, tuple(settings["outputs"]), tuple(settings["inputs"]), first_axis)
    views = []
    for number, (output, input) in enumerate(group.entries):
        entry = f"{output}/{input}"
        state, viewed = State(f"{name} {entry}", first_axis + number), RunFeed(directory, entry)
        state.group, state.entry = group, entry
        viewed.begin(state)
        views.append((state, viewed))
    if not all(viewed.fill_from_means(state) for state, viewed in views):
        for part in run.matrix_batches():
            for (state, viewed), (output, input) in zip(views, group.entries):
                viewed.pass_new(state, part.entry(output, input))
    for state, viewed in views:
        viewed.rest(state)
    return views
