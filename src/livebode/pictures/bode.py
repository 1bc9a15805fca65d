"""The Bode plot of a run: magnitude, phase and coherence over frequency, with the range over the run and the bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import COVERAGE, Model, Response, Responses, decibels, moment
from livebode.language import tr, trn
from livebode.pictures import ticks, words
from livebode.pictures._style import Style, drawing, empty_note, heading, new_figure, plain, style
from livebode.pictures.curves import Summary, bound_db, bound_deg, summarised
from livebode.pictures.plots import FEW_LINES, alone, band, bound

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LEFT = 0.085
_FIT_POINTS = 600


def bode_figure(
    responses: Responses,
    *,
    title: str = "",
    names: tuple[str, str] | None = None,
    fitted: Model | None = None,
    mean: Response | None = None,
    dark: bool = False,
) -> Figure:
    """Magnitude (dB), unwrapped phase (degrees) and, if known, coherence over logarithmic frequency.

    A curve shows the median over the valid responses (separately for magnitude and phase, the phase around its mean
    direction; summary.py explains why not the complex mean), a light band their range of 5–95 %, and another colour
    the newest valid response with its bound, which covers the true value with a probability of 95 %. Lines that were
    never valid remain open.

    Parameters
    ----------
    responses
        (rows, lines); may be thinned, partly or wholly invalid, or empty.
    title
        Heading, from the recording; shortened if it does not fit.
    names
        Names of the input and the output channel.
    fitted
        The newest fit, or the fit of the mean; drawn from the first to the last line.
    mean
        The mean of the run; drawn alone with its 95 % bound, instead of median, range and newest response.
    dark
        Whether to draw light on dark.
    """
    look = style(dark)
    summary = summarised(responses, mean)
    with drawing(look):
        coherent = bool(np.isfinite(summary.coherence).any())
        figure = new_figure(9.0, 7.6 if coherent else 6.6)
        heading(figure, look, title or tr("Bode plot"), words.facts(responses, summary.count, names), _LEFT)
        magnitude, phase, *lowest = _panels(figure, coherent)
        _draw(magnitude, look, summary, None if mean else summary.magnitude_db, *_newest_db(summary))
        _draw(phase, look, summary, None if mean else summary.phase_deg, *_newest_deg(summary))
        magnitude.set_ylabel(words.magnitude_label(responses, 46))
        phase.set_ylabel(tr("phase in degrees"))
        if lowest:
            _draw(lowest[0], look, summary, None if mean else summary.coherence, *_newest_coherence(summary))
            lowest[0].set_ylabel(tr("coherence γ²"))
        curve = _curve(summary, fitted) if fitted is not None and summary.count else None
        _scales(look, summary, curve, mean is not None, magnitude, phase, *lowest)
        if summary.count:
            if curve is not None:
                line: dict[str, Any] = {
                    "color": look.ink,
                    "linewidth": 1.0,
                    "dashes": (4, 2),
                    "zorder": 6,
                    "gid": "fit",
                }
                magnitude.plot(curve[0], curve[1], **line)
                phase.plot(curve[0], curve[2], **line)
            _legend(figure, look, summary, fitted is not None, mean is not None)
    return figure


def _curve(summary: Summary, fitted: Model) -> tuple[Floats, Floats, Floats]:
    """The model's Hz, dB and degrees; its phase on the same turn as that of the newest response."""
    lines_hz = summary.responses.lines.frequency_hz
    f = np.union1d(np.geomspace(lines_hz[0], lines_hz[-1], _FIT_POINTS), lines_hz)
    value = fitted.response(f)
    deg = np.degrees(np.unwrap(np.angle(value)))
    away = (summary.newest_phase_deg - deg[np.searchsorted(f, lines_hz)]) / 360
    turns = np.round(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else 0.0
    return f, decibels(np.abs(value)), deg + 360 * turns


def _panels(figure: Figure, coherent: bool) -> list[Axes]:
    height_in = figure.get_size_inches()[1]
    grid = figure.add_gridspec(
        3 if coherent else 2,
        1,
        height_ratios=[3, 2, 1.1] if coherent else [3, 2],
        left=_LEFT,
        right=0.98,
        top=1 - 1.1 / height_in,
        bottom=0.52 / height_in,
        hspace=0.09,
    )
    first = figure.add_subplot(grid[0])
    return [first, *(figure.add_subplot(cell, sharex=first) for cell in (grid[i] for i in range(1, grid.nrows)))]


def _newest_db(summary: Summary) -> tuple[Floats, Floats, Floats]:
    return decibels(summary.newest_value), *bound_db(summary.newest_value, summary.newest_bound)


def _newest_deg(summary: Summary) -> tuple[Floats, Floats, Floats]:
    half = bound_deg(summary.newest_value, summary.newest_bound)
    return summary.newest_phase_deg, summary.newest_phase_deg - half, summary.newest_phase_deg + half


def _newest_coherence(summary: Summary) -> tuple[Floats, Floats, Floats]:
    nothing = np.full(len(summary.responses.lines), np.nan)
    if summary.newest is None:
        return nothing, nothing, nothing
    return np.where(np.isfinite(summary.newest_value), summary.newest.coherence, np.nan), nothing, nothing


def _draw(
    axes: Axes, look: Style, summary: Summary, run: Floats | None, value: Floats, low: Floats, high: Floats
) -> None:
    """Draw one panel: range, median, newest; `run` is (3, lines) or None, the others (lines,)."""
    f = summary.responses.lines.frequency_hz
    few = len(f) <= FEW_LINES
    run_marker: dict[str, Any] = {"marker": "o", "markersize": 4.5} if few else {}
    if summary.count > 1 and run is not None:
        band(axes, f, run[0], run[2], look.run, 0.2, gid="span")
        axes.plot(f, run[1], color=look.run, linewidth=1.6, zorder=3, gid="median", **run_marker)
    bound(axes, f, low, high, look.newest, gid="bound")
    if few:
        axes.plot(f, value, "_", markersize=9, markeredgewidth=2.0, color=look.newest, zorder=5, gid="newest")
    else:
        axes.plot(f, value, color=look.newest, linewidth=0.9, zorder=4, gid="newest")
        single = alone(value)
        axes.plot(f[single], value[single], color=look.newest, linestyle="", marker="o", markersize=3, zorder=4)


def _scales(look: Style, summary: Summary, curve: tuple[Floats, ...] | None, mean: bool, *panels: Axes) -> None:
    from livebode.pictures.scales import frequency_axis

    magnitude, phase, *lowest = panels
    for axes in panels:
        plain(axes)
        axes.yaxis.set_label_coords(-0.066, 0.5)
        frequency_axis(axes, summary.responses.lines.frequency_hz, labels=axes is panels[-1])
    panels[-1].set_xlabel(tr("frequency in Hz"))
    _, db, deg = curve or (np.zeros(0), np.zeros(0), np.zeros(0))
    run_db, run_deg = (np.zeros(0), np.zeros(0)) if mean else (summary.magnitude_db, summary.phase_deg)
    _limits(magnitude, run_db, _newest_db(summary), db, room=3.0)
    low_deg, high_deg = _limits(phase, np.append(run_deg, deg), _newest_deg(summary), deg, room=10.0)
    phase.set_yticks(ticks.phase_ticks(low_deg, high_deg))
    if lowest:
        lowest[0].set_ylim(-0.04, 1.06)
        lowest[0].set_yticks([0.0, 0.5, 1.0])
    if not summary.count:
        empty_note(magnitude, look)
        for axes in (magnitude, phase):
            axes.set_yticks([])


def _limits(
    axes: Axes, run: Floats, newest: tuple[Floats, Floats, Floats], curve: Floats, room: float
) -> tuple[float, float]:
    """Limits that contain range and newest, and bounds and fit as far as these leave room for the rest."""
    drawn = np.concatenate([run.ravel(), newest[0]])
    drawn = drawn[np.isfinite(drawn)]
    if not drawn.size:
        low, high = axes.get_ylim()
        return low, high
    low, high = float(drawn.min()), float(drawn.max())
    reach = max(0.35 * (high - low), room)
    least = np.nanmin(np.concatenate([newest[1], curve]), initial=low)
    most = np.nanmax(np.concatenate([newest[2], curve]), initial=high)
    low, high = max(float(least), low - reach), min(float(most), high + reach)
    margin = max(0.04 * (high - low), room / 3)
    axes.set_ylim(low - margin, high + margin)
    return low - margin, high + margin


def _legend(figure: Figure, look: Style, summary: Summary, fit: bool, mean: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    assert summary.newest is not None
    few = len(summary.responses.lines) <= FEW_LINES
    handles: list[Any] = []
    texts: list[str] = []
    if summary.count > 1 and not mean:
        handles = [
            Line2D([], [], color=look.run, linewidth=1.6, marker="o" if few else "", markersize=4.5),
            Patch(facecolor=look.run, alpha=0.25),
        ]
        texts = [
            trn("median of {n} response with a valid line", "median of {n} responses with a valid line", summary.count),
            tr("5–95 % of them"),
        ]
    mark: dict[str, Any] = {"linestyle": "", "marker": "+", "markersize": 10, "markeredgewidth": 1.8} if few else {}
    handles.append(Line2D([], [], color=look.newest, linewidth=1.6, **mark))
    at_s = summary.newest.time_s
    newest = tr("newest, at {time}", time=moment(at_s, 2))
    if np.isfinite(summary.newest_bound).any():
        newest += tr(", bound: {percent:g} %", percent=100 * COVERAGE)
    average = tr("average, bound: {percent:g} %", percent=100 * COVERAGE)
    texts.append(average if mean else newest)
    if fit:
        handles.append(Line2D([], [], color=look.ink, linewidth=1.0, dashes=(4, 2)))
        texts.append(tr("its fit") if mean else tr("newest fit"))
    figure.legend(
        handles,
        texts,
        loc="upper left",
        bbox_to_anchor=(_LEFT, 1 - 0.76 / figure.get_size_inches()[1]),
        ncols=len(texts),
        borderpad=0.0,
        borderaxespad=0.0,
        handlelength=1.6,
        columnspacing=2.0,
    )
