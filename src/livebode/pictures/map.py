"""Maps over frequency for runs with many lines: the magnitude, and its change from the median of the run."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Responses, decibels
from livebode.language import numerals, tr
from livebode.pictures import ticks, words
from livebode.pictures.curves import quantiles
from livebode.pictures.figure import ABOVE, BELOW, Cells, Panel, Scale, empty_scale, room, unlabelled, value_scale

# About one cell for two pixels of the picture: finer cells cost time and show no more detail.
_TIME_CELLS_MAX = 400
_SCHEDULE_CELLS_MAX = 80
_LINE_CELLS_MAX = 250
_HEIGHT, _BETWEEN = 190.0, 12.0
BAR = 14.0
"""Width of a bar of colours."""


def maps(responses: Responses, use: NDArray[np.bool_], schedule: str | None) -> tuple[list[Panel], float]:
    """Two rows of maps (magnitude above, change below) over the schedule, if any, and over time; and their height."""
    frequency_hz, level_db = grouped_lines(
        responses.lines.frequency_hz, decibels(np.where(use, responses.value, np.nan))
    )
    change_db = level_db - quantiles(level_db)[1]
    origin_s, time_label = words.clock(responses.time_s)
    across = [(responses.time_s - origin_s, _TIME_CELLS_MAX, time_label)]
    if schedule:
        across.insert(0, (responses.schedule, min(_SCHEDULE_CELLS_MAX, max(8, len(responses) // 5)), schedule))
    level_label = words.magnitude_label(responses, 40)
    rows: tuple[tuple[Literal["level", "change"], Floats, tuple[float, float], str], ...] = (
        ("level", level_db, level_limits(level_db), level_label),
        ("change", change_db, change_limits(change_db), tr("change from the median in dB")),
    )  # fmt: skip
    bars = [value_scale(*limits, label, 5) for _, _, limits, label in rows]
    panels, top = [], 0.0
    for i, (kind, values, *_) in enumerate(rows):
        top += ABOVE
        shown = [(gridded(x, values, cells), name) for x, cells, name in across]
        panels += map_row(
            shown, frequency_hz, bars[i], kind, top=top, right=588.0 - room(*bars), last=i == len(rows) - 1
        )
        top += _HEIGHT
    return panels, top + BELOW


def map_row(
    shown: list[tuple[tuple[Floats, Floats], str]], frequency_hz: Floats, bar: Scale, kind: Literal["level", "change"],
    *, top: float, right: float, last: bool,
) -> list[Panel]:  # fmt: skip
    """Maps beside each other, ((edges, cells), label) each, over one frequency, and the bar with their colours."""
    edges_hz = frequency_edges(frequency_hz)
    y = map_scale(frequency_hz, edges_hz)
    left, limits = room(y), (bar.low, bar.high)
    width = (right - BAR - left) / len(shown) - _BETWEEN
    panels = []
    for i, ((edges, cells), name) in enumerate(shown):
        x = value_scale(edges[0], edges[-1], name, 7 // len(shown))
        marks = [Cells(kind, (edges[0], edges[-1]), edges_hz, cells, limits, kind)]
        place = left + i * (width + _BETWEEN)
        x, beside = x if last else unlabelled(x), y if not i else unlabelled(y)
        panels.append(Panel(place, top, width, _HEIGHT, x, beside, marks, grid=False))
    return [*panels, colour_bar(bar, kind, right=right, top=top, height=_HEIGHT)]


def colour_bar(bar: Scale, kind: Literal["level", "change"], *, right: float, top: float, height: float) -> Panel:
    """The colours of maps with their numbers at the right."""
    values = np.linspace(bar.low, bar.high, 256)
    middles = (values[np.newaxis, 1:] + values[np.newaxis, :-1]) / 2
    colours = Cells("bar", (0.0, 1.0), values, middles, (bar.low, bar.high), kind)
    return Panel(right - BAR, top, BAR, height, empty_scale(), bar, [colours], right=True, grid=False)


def map_scale(frequency_hz: Floats, edges_hz: Floats) -> Scale:
    """Frequency from the lowest to the highest edge, at the lines where there is room."""
    low, high = float(edges_hz[0]), float(edges_hz[-1])
    major = ticks.line_ticks(frequency_hz, low, high, 8)
    texts = [numerals(ticks.frequency_label(f)) for f in major]
    return Scale(low, high, major, texts, logarithmic=True, label=tr("frequency in Hz"))


def level_limits(level_db: Floats) -> tuple[float, float]:
    """Limits that contain all cells."""
    known = level_db[np.isfinite(level_db)]
    low = float(known.min())
    return low, max(float(known.max()), low + 0.1)


def change_limits(change_db: Floats) -> tuple[float, float]:
    """Limits symmetric around zero that contain 99 % of the cells, so that an outlier does not hide the rest."""
    known = np.abs(change_db[np.isfinite(change_db)])
    reach = max(float(np.quantile(known, 0.99)), 0.1)
    return -reach, reach


def grouped_lines(frequency_hz: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Reduce to at most 250 lines: neighbours share a cell that shows the first valid value in each row."""
    group = -(-len(frequency_hz) // _LINE_CELLS_MAX)
    if group == 1:
        return frequency_hz, values
    starts = np.arange(0, len(frequency_hz), group)
    merged = values[:, starts].copy()
    for step in range(1, group):
        beside = values[:, np.minimum(starts + step, len(frequency_hz) - 1)]
        merged = np.where(np.isfinite(merged), merged, beside)
    return frequency_hz[starts], merged


def gridded(x: Floats, values: Floats, cells_max: int) -> tuple[Floats, Floats]:
    """Edges (cells + 1,) and medians (cells, lines) of the rows that fall in each cell; NaN in an empty cell."""
    known = np.isfinite(x)
    x, values = x[known], values[known]
    if not x.size:
        return np.array([0.0, 1.0]), np.full((1, values.shape[1]), np.nan)
    low, high = float(x.min()), float(x.max())
    cells = max(1, min(cells_max, len(x)))
    step = (high - low) / max(cells - 1, 1) or 1.0
    cell = np.clip(np.rint((x - low) / step).astype(np.intp), 0, cells - 1)
    edges = low + step * (np.arange(cells + 1) - 0.5)
    order = np.argsort(cell, kind="stable")
    bounds = np.searchsorted(cell[order], np.arange(cells + 1))
    if len(x) == cells and np.all(np.diff(bounds) == 1):
        return np.asarray(edges), np.asarray(values[order])
    out = np.full((cells, values.shape[1]), np.nan)
    sizes = np.diff(bounds)
    for size in np.unique(sizes[sizes > 0]):  # cells of equal size together: those of time have two or three sizes
        full = np.flatnonzero(sizes == size)
        rows = order[bounds[full] + np.arange(size)[:, np.newaxis]]
        out[full] = quantiles(values[rows].reshape(size, -1))[1].reshape(full.size, -1)
    return np.asarray(edges), out


def frequency_edges(frequency_hz: Floats) -> Floats:
    """Edges of the cells on a logarithmic axis, half-way between the lines."""
    if len(frequency_hz) == 1:
        return np.asarray(frequency_hz[0] * np.array([0.9, 1.1]))
    log_hz = np.log(frequency_hz)
    middle = (log_hz[1:] + log_hz[:-1]) / 2
    return np.asarray(np.exp(np.concatenate([[2 * log_hz[0] - middle[0]], middle, [2 * log_hz[-1] - middle[-1]]])))
