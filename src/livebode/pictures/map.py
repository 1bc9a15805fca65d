"""Maps over frequency for runs with many lines: the magnitude, and its change from the median of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Responses, decibels
from livebode.language import tr
from livebode.pictures import ticks, words
from livebode.pictures._style import Style, plain
from livebode.pictures.curves import quantiles

if TYPE_CHECKING:
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec


# About one cell for two pixels of the picture: finer cells cost time and show no more detail.
_TIME_CELLS_MAX = 400
_SCHEDULE_CELLS_MAX = 80
_LINE_CELLS_MAX = 250


def draw_maps(
    figure: Figure, look: Style, responses: Responses, use: NDArray[np.bool_], schedule: str | None, left: float
) -> None:
    """Draw two rows of maps (magnitude above, change below) over the schedule, if any, and over time."""
    width_in, height_in = figure.get_size_inches()
    grid = figure.add_gridspec(
        2,
        3 if schedule else 2,
        width_ratios=[1, 1, 0.028] if schedule else [1, 0.02],
        left=left,
        right=1 - 0.85 / width_in,
        top=1 - 0.8 / height_in,
        bottom=0.52 / height_in,
        hspace=0.07,
        wspace=0.07,
    )
    frequency_hz, level_db = grouped_lines(
        responses.lines.frequency_hz, decibels(np.where(use, responses.value, np.nan))
    )
    change_db = level_db - quantiles(level_db)[1]
    origin_s, time_label = words.clock(responses.time_s)
    across = [(responses.time_s - origin_s, _TIME_CELLS_MAX, time_label)]
    if schedule:
        across.insert(0, (responses.schedule, min(_SCHEDULE_CELLS_MAX, max(8, len(responses) // 5)), schedule))
    shown = ((level_db, _level_colours(level_db)), (change_db, _change_colours(look, change_db)))
    for row, (values, colours) in enumerate(shown):
        meshes = [
            _map(figure, look, grid[row, i], x, cells, frequency_hz, values, colours)
            for i, (x, cells, _) in enumerate(across)
        ]
        axes = figure.axes[-len(meshes) :]
        for i, panel in enumerate(axes):
            panel.tick_params(axis="both", labelbottom=row == 1, labelleft=i == 0)
            if row == 1:
                panel.set_xlabel(across[i][2])
        axes[0].set_ylabel(tr("frequency in Hz"))
        name = words.magnitude_label(responses, 40) if row == 0 else tr("change from the median in dB")
        _colour_bar(figure, grid[row, -1], meshes[-1], name, extend="neither" if row == 0 else "both")


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
    log_hz = np.log(frequency_hz)
    middle = (log_hz[1:] + log_hz[:-1]) / 2
    return np.asarray(np.exp(np.concatenate([[2 * log_hz[0] - middle[0]], middle, [2 * log_hz[-1] - middle[-1]]])))


def _map(
    figure: Figure,
    look: Style,
    cell: SubplotSpec,
    x: Floats,
    cells_max: int,
    frequency_hz: Floats,
    values: Floats,
    colours: dict[str, Any],
) -> QuadMesh:
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    axes = figure.add_subplot(cell)
    plain(axes, grid=False)
    axes.set_facecolor(look.nothing)
    edges, out = gridded(x, values, cells_max)
    edges_hz = frequency_edges(frequency_hz)
    axes.set_yscale("log")
    mesh = axes.pcolormesh(edges, edges_hz, np.ma.masked_invalid(out.T), rasterized=True, **colours)
    axes.set_ylim(edges_hz[0], edges_hz[-1])
    major = ticks.frequency_ticks(edges_hz[0], edges_hz[-1], most=9)
    axes.yaxis.set_major_locator(FixedLocator(major))
    axes.yaxis.set_major_formatter(FixedFormatter([ticks.frequency_label(f) for f in major]))
    axes.yaxis.set_minor_locator(NullLocator())
    return mesh


def _level_colours(level_db: Floats) -> dict[str, Any]:
    known = level_db[np.isfinite(level_db)]
    return {"cmap": "viridis", "vmin": float(known.min()), "vmax": max(float(known.max()), float(known.min()) + 0.1)}


def _change_colours(look: Style, change_db: Floats) -> dict[str, Any]:
    """Limits symmetric around zero that contain 99 % of the cells, so that an outlier does not hide the rest."""
    known = np.abs(change_db[np.isfinite(change_db)])
    reach = max(float(np.quantile(known, 0.99)), 0.1)
    return {"cmap": look.change_map, "vmin": -reach, "vmax": reach}


def _colour_bar(figure: Figure, cell: SubplotSpec, mesh: QuadMesh, label: str, extend: str) -> None:
    bar = figure.colorbar(mesh, cax=figure.add_subplot(cell), extend=extend)
    bar.outline.set_visible(False)
    bar.set_label(label, size=9.5)
    bar.ax.tick_params(length=3.0)
