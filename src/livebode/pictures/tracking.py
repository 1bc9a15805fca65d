"""Magnitude of each line over time, and over the schedule if there is one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import COVERAGE, Responses, decibels
from livebode.language import numerals, tr
from livebode.pictures import ticks, words
from livebode.pictures._style import Style, drawing, empty_note, heading, new_figure, plain, shortened, style
from livebode.pictures.curves import usable
from livebode.pictures.map import draw_maps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# More traces than this cannot be distinguished by colour and label; maps are drawn instead.
TRACES_MAX = 10
# A step in time this many times the usual one is a gap in the recording; no line is drawn across it.
_HOLE_STEPS = 2.5


def tracking_figure(
    responses: Responses, *, title: str = "", schedule_name: str = "", dark: bool = False, width_in: float | None = None
) -> Figure:
    """Magnitude of every line in dB over time and, if the run has a schedule that varies, over the schedule.

    Up to ten lines are traces with a light band, the bound that covers the true value with a probability of 95 %,
    each labelled at its end. Over the schedule they are points, filled while it rises and hollow while it falls,
    because the response of a moving machine depends on the direction. More lines become maps over frequency: the
    magnitude, and below it the change from the median of the run. Intervals without a valid response remain open.

    Parameters
    ----------
    responses
        (rows, lines); may be thinned, partly or wholly invalid, or empty.
    title
        Heading, from the recording; shortened if it does not fit.
    schedule_name
        Name of the scheduling signal with its unit, for the axis.
    dark
        Whether to draw light on dark.
    width_in
        Width of the picture; default: 9.5 inches, or 12 with a schedule.
    """
    look = style(dark)
    use = usable(responses)
    schedule = scheduled(responses, use)
    name = shortened(schedule_name, 60) or tr("scheduling signal")
    mapped = len(responses.lines) > TRACES_MAX
    with drawing(look):
        figure = new_figure(width_in or (12.0 if schedule else 9.5), 7.0 if mapped else 5.6)
        left = 0.78 / figure.get_size_inches()[0]
        facts = words.facts(responses, int(use.any(axis=1).sum()))
        if mapped and use.any():
            facts += " · " + tr("grey: no valid response")
        heading(figure, look, title or tr("Tracking"), facts, left)
        if not use.any():
            _empty(figure, look, responses, left)
        elif mapped:
            draw_maps(figure, look, responses, use, name if schedule else None, left)
        else:
            _traces(figure, look, responses, use, name if schedule else None, left)
    return figure


def scheduled(responses: Responses, use: NDArray[np.bool_]) -> bool:
    """Whether the scheduling signal has at least two values at valid responses."""
    schedule = responses.schedule[use.any(axis=1)]
    schedule = schedule[np.isfinite(schedule)]
    return bool(schedule.size > 1 and schedule.max() > schedule.min())


def _empty(figure: Figure, look: Style, responses: Responses, left: float) -> None:
    axes = figure.add_axes((left, 0.12, 0.97 - left, 0.7))
    plain(axes)
    empty_note(axes, look)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel(tr("time in s"))
    axes.set_ylabel(words.magnitude_label(responses))


def _traces(
    figure: Figure, look: Style, responses: Responses, use: NDArray[np.bool_], schedule: str | None, left: float
) -> None:
    width_in, height_in = figure.get_size_inches()
    grid = figure.add_gridspec(
        1,
        2 if schedule else 1,
        left=left,
        right=1 - 0.75 / width_in,
        top=1 - 1.1 / height_in,
        bottom=0.55 / height_in,
        wspace=0.06,
    )
    values = np.where(use, responses.value, np.nan)
    bounds = bounds_db(values, np.where(use, responses.bound(), np.nan))
    colours = look.traces[: len(responses.lines)]
    panels = []
    if schedule:
        panels.append(figure.add_subplot(grid[0]))
        _against_schedule(panels[0], look, responses, decibels(values), bounds, colours)
        panels[0].set_xlabel(schedule)
    time = figure.add_subplot(grid[-1], sharey=panels[0] if panels else None)
    panels.append(time)
    _against_time(time, responses, decibels(values), bounds, colours)
    for axes in panels:
        plain(axes)
    _limits(time, decibels(values), bounds)
    panels[0].set_ylabel(words.magnitude_label(responses, 58))
    time.tick_params(axis="y", labelleft=not schedule)
    _name_lines(time, responses, decibels(values), colours)
    _key(figure, look, left, bool(schedule), bool(np.isfinite(bounds).any()))


def bounds_db(value: NDArray[np.complex128], bound: Floats) -> Floats:
    """Lower and upper bound of the magnitude in dB, shape (2, rows, lines); −1000 dB if the bound contains zero."""
    size = np.abs(value)
    return np.array([np.maximum(decibels(np.maximum(size - bound, 0.0)), -1000.0), decibels(size + bound)])


def _against_time(
    axes: Axes, responses: Responses, magnitude_db: Floats, bounds: Floats, colours: tuple[str, ...]
) -> None:
    origin_s, label = words.clock(responses.time_s)
    keep = np.isfinite(responses.time_s)
    time_s, (magnitude_db, low, high) = with_holes(
        responses.time_s[keep] - origin_s, [magnitude_db[keep], bounds[0][keep], bounds[1][keep]]
    )
    for i, colour in enumerate(colours):
        axes.fill_between(time_s, low[:, i], high[:, i], color=colour, alpha=0.18, linewidth=0, gid="bound")
        axes.plot(time_s, magnitude_db[:, i], color=colour, linewidth=1.3, gid="magnitude")
        known = np.isfinite(magnitude_db[:, i])
        beside = np.append(known[1:], False) | np.append(False, known[:-1])
        alone = known & ~beside
        axes.plot(time_s[alone], magnitude_db[alone, i], color=colour, linestyle="", marker="o", markersize=4)
        axes.vlines(time_s[alone], low[alone, i], high[alone, i], color=colour, alpha=0.4, linewidth=4)
    axes.set_xlabel(label)
    axes.margins(x=0.01)


def with_holes(time_s: Floats, columns: list[Floats]) -> tuple[Floats, list[Floats]]:
    """Insert a NaN row at each jump of the time, so that no line is drawn across a gap of the recording."""
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if steps.size else 0.0
    jumps = np.flatnonzero((steps > _HOLE_STEPS * usual) | (steps < 0)) + 1 if usual > 0 else np.zeros(0, dtype=np.intp)
    return np.insert(time_s, jumps, time_s[jumps - 1]), [np.insert(c, jumps, np.nan, axis=0) for c in columns]


def _against_schedule(
    axes: Axes,
    look: Style,
    responses: Responses,
    magnitude_db: Floats,
    bounds: Floats,
    colours: tuple[str, ...],
) -> None:
    x = responses.schedule
    falling = is_falling(x)
    size = float(np.clip(60.0 / np.sqrt(max(len(x), 1)), 2.0, 4.5))
    faint = float(np.clip(64.0 / max(len(x), 1), 0.04, 0.16))  # many strokes overlap
    for i, colour in enumerate(colours):
        known = np.isfinite(bounds[0][:, i]) & np.isfinite(x)
        axes.vlines(
            x[known], bounds[0][known, i], bounds[1][known, i], color=colour, alpha=faint, linewidth=1.5, gid="bound"
        )
        for fall, face in ((False, colour), (True, look.paper)):
            rows = falling == fall
            axes.plot(
                x[rows],
                magnitude_db[rows, i],
                "o",
                markersize=size,
                markeredgewidth=0.7,
                markeredgecolor=colour,
                markerfacecolor=face,
                gid="falling" if fall else "rising",
            )
    axes.margins(x=0.02)


def is_falling(schedule: Floats) -> NDArray[np.bool_]:
    """Mask of the rows in which the scheduling signal falls; a row at standstill has the previous direction."""
    known = np.flatnonzero(np.isfinite(schedule))
    falling = np.zeros(len(schedule), dtype=bool)
    if known.size < 2:
        return falling
    steps = np.diff(schedule[known])
    moving = np.where(steps != 0, np.arange(steps.size), -1)
    last = np.maximum.accumulate(moving)
    first = int(np.argmax(steps != 0))
    down = steps[np.where(last < 0, first, last)] < 0
    falling[known] = np.append(down[0], down)
    return falling


def _limits(axes: Axes, magnitude_db: Floats, bounds: Floats) -> None:
    known = magnitude_db[np.isfinite(magnitude_db)]
    low, high = float(known.min()), float(known.max())
    reach = max(0.3 * (high - low), 3.0)
    low = max(float(np.nanmin(bounds[0], initial=low)), low - reach)
    high = min(float(np.nanmax(bounds[1], initial=high)), high + reach)
    margin = max(0.04 * (high - low), 0.5)
    axes.set_ylim(low - margin, high + margin)


def _name_lines(axes: Axes, responses: Responses, magnitude_db: Floats, colours: tuple[str, ...]) -> None:
    """Label each trace with its frequency at the right edge, at its last value; shift labels that would overlap."""
    low, high = axes.get_ylim()
    height_pt = axes.get_position().height * axes.figure.get_size_inches()[1] * 72  # type: ignore[union-attr]
    ended = [(i, c[np.isfinite(c)][-1]) for i, c in enumerate(magnitude_db.T) if np.isfinite(c).any()]
    heights = spread(np.array([(level - low) / (high - low) for _, level in ended]), 12.0 / height_pt)
    for (i, level), y in zip(ended, heights):
        axes.annotate(
            f"{numerals(ticks.frequency_label(responses.lines.frequency_hz[i]))} Hz",
            xy=(1.0, (level - low) / (high - low)),
            xytext=(1.025, y),
            xycoords="axes fraction",
            textcoords="axes fraction",
            color=colours[i],
            size=9.5,
            weight="bold",
            va="center",
            arrowprops={"arrowstyle": "-", "color": colours[i], "linewidth": 0.8, "shrinkA": 1.0, "shrinkB": 0.0},
        )


def spread(required: Floats, apart: float) -> Floats:
    """Positions at least `apart` from each other, in the same order, as near as possible to the given ones in 0 … 1.

    >>> spread(np.array([0.5, 0.52, 0.9]), 0.1)
    array([0.46, 0.56, 0.9 ])
    """
    order = np.argsort(required, kind="stable")
    groups: list[list[float]] = []  # centre, count
    for level in required[order]:
        groups.append([float(level), 1.0])
        while len(groups) > 1:
            (c0, n0), (c1, n1) = groups[-2:]
            if c1 - c0 >= apart * (n0 + n1) / 2:
                break
            groups[-2:] = [[(c0 * n0 + c1 * n1) / (n0 + n1), n0 + n1]]
    placed = [c + apart * (k - (n - 1) / 2) for c, n in groups for k in range(int(n))]
    out = np.empty(len(required))
    out[order] = placed
    return out


def _key(figure: Figure, look: Style, left: float, schedule: bool, bounded: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    height_in = figure.get_size_inches()[1]
    entries: list[tuple[Line2D | Patch, str]] = []
    if schedule:
        dot = {"linestyle": "", "marker": "o", "markersize": 4.5, "markeredgecolor": look.muted}
        entries.append((Line2D([], [], markerfacecolor=look.muted, **dot), tr("rising")))  # type: ignore[arg-type]
        entries.append((Line2D([], [], markerfacecolor=look.paper, **dot), tr("falling")))  # type: ignore[arg-type]
    if bounded:
        entries.append((Patch(facecolor=look.muted, alpha=0.3), tr("bound: {percent:g} %", percent=100 * COVERAGE)))
    figure.legend(
        [handle for handle, _ in entries],
        [text for _, text in entries],
        loc="upper left",
        bbox_to_anchor=(left, 1 - 0.76 / height_in),
        ncols=3,
        borderpad=0.0,
        borderaxespad=0.0,
        handlelength=1.4,
        columnspacing=1.8,
    )
