"""Tiers: means of the responses over 1 s, 1 min and 1 h beside the full ones, so that a year is read in few rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from livebode.core import Lines, Responses
from livebode.fitting import BinnedMeans, binned_means, combined
from livebode.records.response_table import SCHEMA, as_batch, responses_in
from livebode.records.run import RunRecord, lines_in
from livebode.records.segments import reading
from livebode.records.segments.manifest import TIERS, Segment
from livebode.tables import Field, Schema, Table

BIN_S = dict(zip(TIERS, (1.0, 60.0, 3600.0)))
"""The tables and the spans of their means."""

TIER_SCHEMA = Schema((*SCHEMA, Field("count", "int64"), Field("windows", "float64"), Field("responses", "int64")))
"""Columns: those of the responses, and number of the responses in the mean at the line, of windows without overlap
with the same information, and of all responses of the span."""

_FEWER = 2  # a tier has at most half as many rows as there are responses


class Thinning:
    """The tiers of a run.

    Parameters
    ----------
    found
        Entry ``found`` of run.json: grid, hop, quantity and unit.
    """

    def __init__(self, found: Mapping[str, Any]) -> None:
        self._found, self._lines = found, lines_in(found)
        hop_s = found.get("hop", self._lines.window) / self._lines.rate_hz
        self._bins = {table: bin_s for table, bin_s in BIN_S.items() if bin_s >= _FEWER * hop_s}

    def tables(self, rows: Mapping[str, Table]) -> dict[str, Table]:
        """The rows of each tier for the rows of a journal; none if damage cut its responses."""
        responses = rows.get("responses")
        if responses is None or not responses.num_rows or responses.num_rows % len(self._lines):
            return {}
        whole = responses_in(responses, self._lines, self._found)
        return {table: _rows_of(binned_means(whole, bin_s)) for table, bin_s in self._bins.items()}


def thinned(run: RunRecord, bin_s: float, span_s: tuple[float, float] | None = None) -> Responses | None:
    """Means over spans of `bin_s` seconds from the largest tier that is short enough; None without one.

    Responses from before the run had tiers, and those that are not in a segment yet, are averaged when they are read.
    """
    parts = run.parts()
    tables = [table for table, each_s in BIN_S.items() if each_s <= bin_s]
    if parts is None or not tables:
        return None
    segments, rows = parts
    tier = [segment for segment in segments if segment.table == tables[-1]]
    if not tier:
        return None
    lines, found = run.lines, run.found
    begin = min(segment.first_sample for segment in tier)
    before = [one for one in segments if one.table == "responses" and one.last_sample < begin]
    means: list[BinnedMeans] = []
    for segment in [one for one in (*before, *tier) if _within(one, span_s)]:
        if (file := reading.whole(run.path, segment, run.report)) is not None:
            table = file.table()
            means.append(_means_of(table, lines, found, None if segment.table in BIN_S else bin_s))
    if "responses" in rows:
        means.append(_means_of(Table.join(rows["responses"]), lines, found, bin_s))
    if not means:
        return None
    whole = combined(BinnedMeans.join(means), bin_s).means
    return whole if span_s is None else whole.between(*span_s)


def _within(segment: Segment, span_s: tuple[float, float] | None) -> bool:
    return span_s is None or (segment.first_s <= span_s[1] and segment.last_s >= span_s[0])


def _rows_of(means: BinnedMeans) -> Table:
    columns = as_batch(means.means).columns
    lines = len(means.means.lines)
    more = means.count.ravel(), means.windows.ravel(), np.repeat(means.responses, lines)
    return Table(TIER_SCHEMA, (*columns, *more))


def _means_of(table: Table, lines: Lines, found: Mapping[str, Any], bin_s: float | None) -> BinnedMeans:
    """The means in rows of a tier, or with `bin_s` those of full responses."""
    means = responses_in(table, lines, found)
    if bin_s is not None:
        return binned_means(means, bin_s)
    shape = means.value.shape
    count, windows, responses = (table[name].reshape(shape) for name in ("count", "windows", "responses"))
    return BinnedMeans(means, count, windows, responses[:, 0])
