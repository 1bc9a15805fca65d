"""Tiers: means of the responses over 1 s, 1 min and 1 h beside the full ones, so that a year is read in few rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from livebode.core import Lines, Responses
from livebode.fitting import BinnedMeans, SharedWindows, binned_means, combined
from livebode.records.matrix_table import entry_rows
from livebode.records.response_table import RESPONSE_SCHEMA, as_batch, responses_in, with_variation
from livebode.records.run import RunRecord, lines_in
from livebode.records.segments import reading
from livebode.records.segments.manifest import TIERS, Segment
from livebode.tables import Field, Schema, Table, Text

BIN_S = dict(zip(TIERS, (1.0, 60.0, 3600.0)))
"""The tables and the spans of their means."""

TIER_SCHEMA = Schema(
    (*RESPONSE_SCHEMA, Field("count", "int64"), Field("windows", "float64"), Field("responses", "int64"))
)
"""Columns: those of the responses, and number of the responses in the mean at the line, of windows without overlap
with the same information, and of all responses of the span."""

MATRIX_TIER_SCHEMA = Schema((*TIER_SCHEMA, Field("output", "string"), Field("input", "string")))
"""Of a matrix run also the names of the entry."""

_FEWER = 2  # a tier has at most half as many rows as there are responses


class Thinning:
    """The tiers of a run.

    Parameters
    ----------
    found
        Entry ``found`` of run.json: grid, hop, quantity and unit; of a matrix run also its signals and experiments.
    """

    def __init__(self, found: Mapping[str, Any]) -> None:
        self._found, self._lines = found, lines_in(found)
        self._entries = [(o, i) for o in found.get("outputs", ()) for i in found.get("inputs", ())]
        each_s = _samples_between(found, self._lines) / self._lines.rate_hz
        self._bins = {table: bin_s for table, bin_s in BIN_S.items() if bin_s >= _FEWER * each_s}

    def tables(self, rows: Mapping[str, Table]) -> dict[str, Table]:
        """The rows of each tier for the rows of a journal; none if damage cut its responses."""
        responses = None if "responses" not in rows else with_variation(rows["responses"])
        each = len(self._lines) * max(1, len(self._entries))
        if responses is None or not responses.num_rows or responses.num_rows % each:
            return {}
        if not self._entries:
            whole = responses_in(responses, self._lines, self._found)
            return {table: _rows_of(binned_means(whole, bin_s)) for table, bin_s in self._bins.items()}
        entries = [responses_in(entry_rows(responses, *names), self._lines, self._found) for names in self._entries]
        shared = _shared_windows(self._found, self._lines)
        return {
            table: self._side_by_side([_rows_of(binned_means(entry, bin_s, shared)) for entry in entries])
            for table, bin_s in self._bins.items()
        }

    def _side_by_side(self, means: list[Table]) -> Table:
        """The rows of all entries, in order of time: lines within an entry, entries within a mean."""
        lines, rows = len(self._lines), means[0].num_rows // len(self._lines)
        columns: list[Any] = [
            np.stack([entry[name].reshape(rows, lines) for entry in means], axis=1).ravel()
            for name in TIER_SCHEMA.names
        ]
        for side in (0, 1):
            words = list(dict.fromkeys(names[side] for names in self._entries))
            codes = np.repeat([words.index(names[side]) for names in self._entries], lines)
            columns.append(Text.of(words, np.tile(codes, rows)))
        return Table(MATRIX_TIER_SCHEMA, tuple(columns))


def thinned(run: RunRecord, bin_s: float, span_s: tuple[float, float] | None = None) -> Responses | None:
    """Means over spans of `bin_s` seconds from the largest tier that is short enough; None without one.

    Responses from before the run had tiers, and those that are not in a segment yet, are averaged when they are read.
    Of a matrix run `run` is the view of an entry.
    """
    tables = [table for table, each_s in BIN_S.items() if each_s <= bin_s]
    if not tables:
        return None
    segments, rows = run.parts()
    tier = [segment for segment in segments if segment.table == tables[-1]]
    if not tier:
        return None
    begin = min(segment.first_sample for segment in tier)
    before = [segment for segment in segments if segment.table == "responses" and segment.last_sample < begin]
    means: list[BinnedMeans] = []
    for segment in [segment for segment in (*before, *tier) if _within(segment, span_s)]:
        each_s = None if segment.table in BIN_S else bin_s
        if groups := list(reading.segment_rows(run.path, segment, run.report)):
            means.append(_means_of(run, Table.join(groups), each_s))
    if "responses" in rows:
        means.append(_means_of(run, Table.join(rows["responses"]), bin_s))
    if not means:
        return None
    whole = combined(BinnedMeans.join(means), bin_s).means
    return whole if span_s is None else whole.between(*span_s)


def _samples_between(found: Mapping[str, Any], lines: Lines) -> float:
    """Samples between two responses, in the mean: matrices are only in the settled part of the experiments."""
    hop = float(found.get("hop", lines.window))
    experiments = found.get("experiments")
    if experiments is None or experiments["number"] == 1:
        return hop
    used = (experiments["dwell_periods"] - experiments["settle_periods"] - 1) * lines.window // hop + 1
    return float(experiments["dwell_periods"] * lines.window / used)


def _shared_windows(found: Mapping[str, Any], lines: Lines) -> SharedWindows:
    experiments = found.get("experiments")
    if experiments is None:
        return SharedWindows(lines.window)
    return SharedWindows(lines.window, experiments["dwell_periods"] * lines.window, experiments["number"])


def _within(segment: Segment, span_s: tuple[float, float] | None) -> bool:
    return span_s is None or (segment.first_s <= span_s[1] and segment.last_s >= span_s[0])


def _rows_of(means: BinnedMeans) -> Table:
    columns = as_batch(means.means).columns
    lines = len(means.means.lines)
    more = means.count.ravel(), means.windows.ravel(), np.repeat(means.responses, lines)
    return Table(TIER_SCHEMA, (*columns, *more))


def _means_of(run: RunRecord, table: Table, bin_s: float | None) -> BinnedMeans:
    """The means in rows of a tier, or with `bin_s` those of full responses."""
    lines, found, table = run.lines, run.found, with_variation(table)
    if run.selected is not None:
        names = RESPONSE_SCHEMA.names if bin_s is not None else TIER_SCHEMA.names
        table = entry_rows(table, *run.selected, names)
    means = responses_in(table, lines, found)
    if bin_s is not None:
        return binned_means(means, bin_s, _shared_windows(found, lines))
    shape = means.value.shape
    count, windows, responses = (table[name].reshape(shape) for name in ("count", "windows", "responses"))
    return BinnedMeans(means, count, windows, responses[:, 0])
