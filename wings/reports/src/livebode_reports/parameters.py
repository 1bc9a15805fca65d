"""Fitted parameters or margins over time, one panel each, with bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Floats
from livebode.pictures import Style, clock, drawing, labelled, new_figure, plain, shortened, style, with_holes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Curve = tuple[str, str, Floats, Floats]
"""Name, unit, values and half-widths of the bounds, (rows,) each; NaN if there is no value."""

_COLUMNS = 2
_REACH = 4.0  # times the range of 90 % of the values: one wide bound must not flatten the rest


def parameters_figure(time_s: Floats, curves: Sequence[Curve], *, dark: bool = False) -> Figure:
    """Draw each curve over time, with a band for its bound; open where there is no value.

    Parameters
    ----------
    time_s
        (rows,).
    curves
        The curves, in order.
    dark
        Whether to draw light on dark.
    """
    look = style(dark)
    rows = -(-len(curves) // _COLUMNS)
    origin_s, label = clock(time_s)
    with drawing(look):
        figure = new_figure(9.0, 0.75 + 1.75 * rows)
        height_in = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            rows, _COLUMNS, left=0.09, right=0.985, top=1 - 0.3 / height_in, bottom=0.5 / height_in,
            hspace=0.42, wspace=0.24,
        )  # fmt: skip
        for i, curve in enumerate(curves):
            axes = figure.add_subplot(grid[i // _COLUMNS, i % _COLUMNS])
            _panel(axes, look, time_s - origin_s, curve)
            last = i + _COLUMNS >= len(curves)
            axes.tick_params(axis="x", labelbottom=last)
            if last:
                axes.set_xlabel(label)
    return figure


def _panel(axes: Axes, look: Style, time_s: Floats, curve: Curve) -> None:
    name, unit, value, half = curve
    times, (middle, low, high) = with_holes(time_s, [x[:, np.newaxis] for x in (value, value - half, value + half)])
    axes.fill_between(times, low[:, 0], high[:, 0], color=look.run, alpha=0.22, linewidth=0, gid="bound")
    axes.plot(times, middle[:, 0], color=look.run, linewidth=1.2, gid="value")
    axes.set_title(
        shortened(labelled(name, unit), 60),
        loc="left",
        size=10,
        color=look.ink,
        pad=4,
    )
    axes.ticklabel_format(axis="y", useOffset=False, scilimits=(-4, 7))
    axes.locator_params(axis="y", nbins=5)
    axes.margins(x=0.01)
    axes.set_xlim(float(np.nanmin(time_s)), float(np.nanmax(time_s)))
    _limits(axes, value, half)
    plain(axes)


def _limits(axes: Axes, value: Floats, half: Floats) -> None:
    known = np.isfinite(value) & np.isfinite(half)
    if not known.any():
        return
    low, middle, high = np.quantile(value[known], [0.05, 0.5, 0.95])
    usual = float(np.median(half[known]))
    reach = _REACH * max(high - low, 2 * usual, 1e-9 * abs(middle), 1e-300)
    least, most = float(np.min((value - half)[known])), float(np.max((value + half)[known]))
    axes.set_ylim(max(least, middle - reach), min(most, middle + reach))
