"""Frequency and damping of the modes of an output-only run over time."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR
from livebode.language import numerals, tr, trn
from livebode.pictures import (
    Style,
    clock,
    drawing,
    heading,
    new_figure,
    plain,
    save,
    spread,
    style,
    with_holes,
)
from livebode_modes.curves import ModeCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


CURVES_MAX = 10
"""Most modes in a picture: those that were found in most windows."""
_REACH = 4.0  # times the range of 90 % of the values: one wide bound must not flatten the rest


def save_modes(curves: Sequence[ModeCurve], directory: str | PathLike[str], *, title: str, facts: str) -> Path:
    """Write modes.png to an existing directory; OSError if it cannot be written."""
    return save(modes_figure(curves, title=title, facts=facts), Path(directory) / "modes.png", style(False))


def modes_figure(curves: Sequence[ModeCurve], *, title: str, facts: str, dark: bool = False) -> Figure:
    """Frequencies above dampings over time, each with its 95 % bound; harmonics are dashed and have no damping.

    Parameters
    ----------
    curves
        Modes and harmonics; the ten that were found most often are drawn.
    title, facts
        Heading, and the line below it.
    dark
        Whether to draw light on dark.
    """
    look = style(dark)
    drawn = sorted(curves, key=lambda curve: -curve.found)[:CURVES_MAX]
    drawn = [curve for curve in curves if curve in drawn and curve.found]
    if left_out := len(curves) - len(drawn):
        facts += " · " + trn("{n} weaker curve not shown", "{n} weaker curves not shown", left_out)
    with drawing(look):
        figure = new_figure(9.5, 6.4)
        width_in, height_in = figure.get_size_inches()
        left = 0.78 / width_in
        heading(figure, look, title, facts, left)
        grid = figure.add_gridspec(
            2, 1, left=left, right=1 - 0.95 / width_in, top=1 - 0.85 / height_in, bottom=0.55 / height_in,
            height_ratios=(3, 2), hspace=0.1,
        )  # fmt: skip
        upper = figure.add_subplot(grid[0])
        lower = figure.add_subplot(grid[1], sharex=upper)
        _panels(upper, lower, look, drawn)
    return figure


def _panels(upper: Axes, lower: Axes, look: Style, curves: Sequence[ModeCurve]) -> None:
    times = np.concatenate([curve.time_s for curve in curves]) if curves else np.zeros(1)
    origin_s, label = clock(times)
    for curve, colour in zip(curves, look.traces):
        time_s = curve.time_s - origin_s
        _line(upper, time_s, curve.frequency_hz, curve.frequency_sigma, colour, dashed=curve.harmonic)
        _line(lower, time_s, 100 * curve.damping, 100 * curve.damping_sigma, colour)
    _limits(upper, [(curve.frequency_hz, curve.frequency_sigma) for curve in curves])
    _limits(lower, [(100 * curve.damping, 100 * curve.damping_sigma) for curve in curves])
    _name(upper, curves, look)
    upper.set_ylabel(tr("frequency in Hz"))
    upper.tick_params(axis="x", labelbottom=False)
    lower.set_ylabel(tr("damping ratio in %"))
    lower.set_xlabel(label)
    for axes in (upper, lower):
        axes.margins(x=0.01)
        plain(axes)
    if not curves:
        upper.text(0.5, 0.5, tr("no mode was found"), transform=upper.transAxes, ha="center", color=look.muted)


def _line(axes: Axes, time_s: Floats, value: Floats, sigma: Floats, colour: str, *, dashed: bool = False) -> None:
    bound = INTERVAL_FACTOR * sigma
    times, (middle, low, high) = with_holes(time_s, [x[:, np.newaxis] for x in (value, value - bound, value + bound)])
    axes.fill_between(times, low[:, 0], high[:, 0], color=colour, alpha=0.22, linewidth=0, gid="bound")
    axes.plot(times, middle[:, 0], color=colour, linewidth=1.3, linestyle="--" if dashed else "-", gid="value")
    known = np.isfinite(middle[:, 0])
    alone = known & ~(np.append(known[1:], False) | np.append(False, known[:-1]))
    axes.errorbar(
        times[alone], middle[alone, 0], (high - middle)[alone, 0], color=colour, linestyle="", marker="o", markersize=4
    )


def _limits(axes: Axes, drawn: Sequence[tuple[Floats, Floats]]) -> None:
    value, sigma = (np.concatenate(part) if drawn else np.zeros(0) for part in zip(*drawn)) if drawn else (None, None)
    if value is None or sigma is None or not (known := np.isfinite(value) & np.isfinite(sigma)).any():
        return
    value, half = value[known], INTERVAL_FACTOR * sigma[known]
    low, high = np.quantile(value, [0.02, 0.98])
    reach = _REACH * max(float(np.median(half)), 0.02 * float(high - low), 1e-3 * float(abs(high)))
    axes.set_ylim(max(float((value - half).min()), low - reach), min(float((value + half).max()), high + reach))
    axes.margins(y=0.05)


def _name(axes: Axes, curves: Sequence[ModeCurve], look: Style) -> None:
    """The newest frequency of each curve at the right edge."""
    low, high = axes.get_ylim()
    ends = [float(curve.frequency_hz[np.isfinite(curve.frequency_hz)][-1]) for curve in curves]
    height_pt = axes.get_position().height * axes.figure.get_size_inches()[1] * 72  # type: ignore[union-attr]
    places = spread((np.array(ends) - low) / (high - low), 12.0 / height_pt)
    for value, place, colour in zip(ends, places, look.traces):
        axes.annotate(
            f"{numerals(f'{value:.4g}')} Hz",
            xy=(1.0, (value - low) / (high - low)),
            xytext=(1.02, float(place)),
            xycoords="axes fraction",
            textcoords="axes fraction",
            color=colour,
            size=9.5,
            weight="bold",
            va="center",
            annotation_clip=False,
        )
