"""Pictures of a comparison: two responses, their ratio, and the differences along the schedule."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Response, decibels
from livebode.language import tr, trn
from livebode.pictures import (
    FEW_LINES,
    Style,
    bound_db,
    bound_deg,
    decibel_label,
    drawing,
    frequency_edges,
    frequency_label,
    heading,
    line_ticks,
    new_figure,
    plain,
    quantity,
    style,
    unwrapped,
)
from livebode.pictures import bound as draw_bound

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PlaceChange = tuple[float, float, bool, Complex, NDArray[np.bool_]]
"""From, to, whether return, ratio and mask of the lines that differ, (lines,) each."""

_HEIGHT_IN = 7.8


def comparison_figure(
    before: Response, after: Response, ratio: Complex, bound: Floats, differs: NDArray[np.bool_], *, dark: bool = False
) -> Figure:
    """Magnitude and phase of both with 95 % bounds; below, the ratio in dB and degrees with its bound.

    Parameters
    ----------
    before, after
        The responses, at the same lines.
    ratio, bound
        After over before and the radius around it, (lines,).
    differs
        Which lines are marked, (lines,).
    dark
        Whether to draw light on dark.
    """
    from livebode.pictures import frequency_axis

    look = style(dark)
    f = before.lines.frequency_hz
    with drawing(look):
        figure = new_figure(9.0, _HEIGHT_IN)
        top = 1 - 1.1 / _HEIGHT_IN
        grid = figure.add_gridspec(
            4, 1, height_ratios=[3, 2, 1.6, 1.6], left=0.085, right=0.98, top=top, bottom=0.48 / _HEIGHT_IN, hspace=0.11
        )
        first = figure.add_subplot(grid[0])
        panels = [first, *(figure.add_subplot(grid[i], sharex=first) for i in (1, 2, 3))]
        lines = trn("{n} line", "{n} lines", len(f))
        different = tr("{count} differ", count=int(differs.sum()))
        facts = f"{quantity(before)} · {lines} · {different}"
        heading(figure, look, tr("Before and after"), facts, 0.085)
        turn = unwrapped(np.degrees(np.angle(before.value)), np.zeros(len(f), dtype=bool))
        drawn = [
            _response(panels[:2], f * 1.004**side, response, turn, colour, name)
            for response, colour, side, name in ((before, look.run, -1, "before"), (after, look.newest, 1, "after"))
        ]
        for axes, values, room in zip(panels, zip(*drawn), (3.0, 10.0)):
            _squeeze(axes, np.concatenate(values), room)
        _ratio(panels[2:], look, f, ratio, bound, differs)
        labels = (
            decibel_label(before.unit), tr("phase in degrees"), tr("ratio in dB"), tr("ratio in degrees"),
        )  # fmt: skip
        for axes, label in zip(panels, labels):
            axes.set_ylabel(label)
            axes.yaxis.set_label_coords(-0.066, 0.5)
            plain(axes)
            frequency_axis(axes, f, labels=axes is panels[-1])
        panels[-1].set_xlabel(tr("frequency in Hz"))
        _legend(figure, look)
    return figure


def _response(
    panels: list[Axes], f: Floats, response: Response, turn: Floats, colour: str, name: str
) -> tuple[Floats, Floats]:
    """Draw magnitude and phase, and return them."""
    value = np.where(response.valid, response.value, np.nan)
    radius = response.bound()
    (low, high), half = bound_db(value, radius), bound_deg(value, radius)
    db, deg = decibels(value), np.degrees(np.angle(value))
    deg = deg - 360 * np.rint((deg - turn) / 360)
    _known(panels[0], f, db, low, high, colour, name)
    _known(panels[1], f, deg, deg - half, deg + half, colour, name)
    return db, deg


def _known(axes: Axes, f: Floats, middle: Floats, low: Floats, high: Floats, colour: str, gid: str) -> None:
    draw_bound(axes, f, low, high, colour, 0.25, gid=f"{gid} bound")
    few: dict[str, Any] = {"marker": "_", "markersize": 8, "markeredgewidth": 2} if len(f) <= FEW_LINES else {}
    axes.plot(f, middle, color=colour, linewidth=0.8 if few else 1.1, gid=gid, **few)


def _ratio(
    panels: list[Axes], look: Style, f: Floats, ratio: Complex, bound: Floats, differs: NDArray[np.bool_]
) -> None:
    (low, high), half = bound_db(ratio, bound), bound_deg(ratio, bound)
    deg = np.degrees(np.angle(ratio))
    for axes, middle, under, over, room in (
        (panels[0], decibels(ratio), low, high, 0.5), (panels[1], deg, deg - half, deg + half, 3.0),
    ):  # fmt: skip
        axes.axhline(0, color=look.muted, linewidth=0.9)
        known = np.isfinite(under) & np.isfinite(middle)
        axes.vlines(f[known], under[known], over[known], color=look.ink, linewidth=1.2, alpha=0.7, gid="ratio bound")
        for mask, face in ((differs, look.ink), (~differs, look.paper)):
            axes.plot(f[mask], middle[mask], "o", markersize=4.5, markeredgecolor=look.ink, markerfacecolor=face,
                      gid="differs" if face == look.ink else "same")  # fmt: skip
        _squeeze(axes, np.append(middle, 0.0), room)


def _squeeze(axes: Axes, drawn: Floats, room: float) -> None:
    """Limits that contain the values, and the bounds as far as these leave room for them."""
    known = drawn[np.isfinite(drawn)]
    if known.size:
        reach = max(0.35 * float(np.ptp(known)), room)
        axes.set_ylim(float(known.min()) - reach, float(known.max()) + reach)


def places_figure(frequency_hz: Floats, places: list[PlaceChange], *, dark: bool = False) -> Figure:
    """The change of the magnitude over place and frequency, forward and return; dots mark significant differences."""
    look = style(dark)
    ways = [[p for p in places if p[2] == back] for back in (False, True)]
    shown = [(way, name) for way, name in zip(ways, (tr("forward (rising)"), tr("return (falling)"))) if way]
    reach = max(float(np.nanmax(np.abs([decibels(p[3]) for p in places]), initial=0.0)), 0.1)
    edges_hz = frequency_edges(frequency_hz) if len(frequency_hz) > 1 else frequency_hz[0] * np.array([0.9, 1.1])
    with drawing(look):
        figure = new_figure(9.0, 3.9)
        grid = figure.add_gridspec(
            1, len(shown) + 1, width_ratios=[*[1.0] * len(shown), 0.03], left=0.085, right=0.92, top=0.9, bottom=0.14,
            wspace=0.08,
        )  # fmt: skip
        mesh: Any = None
        for i, (way, name) in enumerate(shown):
            axes = figure.add_subplot(grid[i])
            axes.set_facecolor(look.nothing)
            for low, high, _, ratio, differs in way:
                mesh = axes.pcolormesh(
                    [low, high], edges_hz, decibels(ratio)[:, np.newaxis], cmap="RdBu_r", vmin=-reach, vmax=reach,
                    rasterized=True,
                )  # fmt: skip
                axes.plot(np.full(differs.sum(), (low + high) / 2), frequency_hz[differs], "o", markersize=3.5,
                          color="#1d2733", markeredgecolor="#ffffff", markeredgewidth=0.6, gid="differs")  # fmt: skip
            _frequencies(axes, frequency_hz, edges_hz)
            axes.set_title(name, loc="left", size=10, color=look.ink)
            axes.set_xlabel(tr("schedule"))
            axes.tick_params(labelleft=i == 0)
            plain(axes, grid=False)
        figure.axes[0].set_ylabel(tr("frequency in Hz"))
        bar = figure.colorbar(mesh, cax=figure.add_subplot(grid[-1]))
        bar.outline.set_visible(False)
        bar.set_label(tr("change in dB"), size=9.5)
    return figure


def _frequencies(axes: Axes, frequency_hz: Floats, edges_hz: Floats) -> None:
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    axes.set_yscale("log")
    axes.set_ylim(edges_hz[0], edges_hz[-1])
    major = line_ticks(frequency_hz, edges_hz[0], edges_hz[-1])
    axes.yaxis.set_major_locator(FixedLocator(major))
    axes.yaxis.set_major_formatter(FixedFormatter([frequency_label(f) for f in major]))
    axes.yaxis.set_minor_locator(NullLocator())


def _legend(figure: Figure, look: Style) -> None:
    from matplotlib.lines import Line2D

    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 4.5, "markeredgecolor": look.ink}
    handles = [
        Line2D([], [], color=look.run, linewidth=1.6),
        Line2D([], [], color=look.newest, linewidth=1.6),
        Line2D([], [], markerfacecolor=look.ink, **dot),
        Line2D([], [], markerfacecolor=look.paper, **dot),
    ]
    figure.legend(
        handles,
        [tr("before, bound: 95 %"), tr("after, bound: 95 %"), tr("differs"), tr("does not differ")], loc="upper left",
        bbox_to_anchor=(0.085, 1 - 0.76 / figure.get_size_inches()[1]), ncols=4, borderpad=0.0, borderaxespad=0.0,
        handlelength=1.6, columnspacing=2.0,
    )  # fmt: skip
