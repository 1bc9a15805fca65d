"""Fitted parameters or margins over time, one panel each, with bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Floats
from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    WIDTH,
    Band,
    Figure,
    Mark,
    Panel,
    Trace,
    clock,
    labelled,
    room,
    unlabelled,
    value_scale,
    with_holes,
)

Curve = tuple[str, str, Floats, Floats]
"""Name, unit, values and half-widths of the bounds, (rows,) each; NaN if there is no value."""

_COLUMNS = 2
_HEIGHT = 96.0
_REACH = 4.0  # times the range of 90 % of the values: one wide bound must not flatten the rest


def parameters_figure(time_s: Floats, curves: Sequence[Curve]) -> Figure:
    """Draw each curve over time, with a band for its bound; open where there is no value.

    Parameters
    ----------
    time_s
        (rows,).
    curves
        The curves, in order.
    """
    origin_s, label = clock(time_s)
    seconds = time_s - origin_s
    x = value_scale(float(np.nanmin(seconds)), float(np.nanmax(seconds)), label, 4)
    scales = [value_scale(*_limits(value, half), labelled(name, unit), 4) for name, unit, value, half in curves]
    left = room(*scales)
    width = WIDTH / _COLUMNS - left - 12.0
    panels = []
    for i, ((_, _, value, half), y) in enumerate(zip(curves, scales)):
        times, (middle, low, high) = with_holes(
            seconds, [v[:, np.newaxis] for v in (value, value - half, value + half)]
        )
        marks: list[Mark] = [
            Band("bound", times, low[:, 0], high[:, 0], LIGHT.run),
            Trace("value", times, middle[:, 0], LIGHT.run, 1.2),
        ]
        across, down = i % _COLUMNS, i // _COLUMNS
        last = i + _COLUMNS >= len(curves)
        place = left + across * WIDTH / _COLUMNS, ABOVE + down * (_HEIGHT + ABOVE + 6.0)
        panels.append(Panel(*place, width, _HEIGHT, x if last else unlabelled(x), y, marks))
    rows = -(-len(curves) // _COLUMNS)
    return Figure("", (), (), panels, rows * (_HEIGHT + ABOVE + 6.0) + BELOW)


def _limits(value: Floats, half: Floats) -> tuple[float, float]:
    known = np.isfinite(value) & np.isfinite(half)
    if not known.any():
        return 0.0, 1.0
    low, middle, high = np.quantile(value[known], [0.05, 0.5, 0.95])
    usual = float(np.median(half[known]))
    reach = _REACH * max(high - low, 2 * usual, 1e-9 * abs(middle), 1e-300)
    least, most = float(np.min((value - half)[known])), float(np.max((value + half)[known]))
    return max(least, middle - reach), min(most, middle + reach)
