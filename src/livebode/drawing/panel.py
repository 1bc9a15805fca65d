"""One panel over frequency: a range, a curve and its bound."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes


FEW_LINES = 40
"""Up to this many lines each has a marker and an error bar; more are drawn as a band."""


def band(axes: Axes, f: Floats, low: Floats, high: Floats, colour: Any, alpha: float, **more: Any) -> None:
    """Fill the range between neighbouring lines; a line without neighbours gets a bar, to be visible."""
    axes.fill_between(f, low, high, color=colour, alpha=alpha, linewidth=0, zorder=2, **more)
    single = alone(low + high)
    if single.any():
        axes.vlines(f[single], low[single], high[single], color=colour, alpha=alpha * 1.5, linewidth=8, zorder=2)


def bound(axes: Axes, f: Floats, low: Floats, high: Floats, colour: Any, alpha: float = 0.28, **more: Any) -> None:
    """Error bars at few lines, a band at many; nothing where an end is not known."""
    if len(f) > FEW_LINES:
        band(axes, f, low, high, colour, alpha, **more)
        return
    known = np.isfinite(low) & np.isfinite(high)
    axes.vlines(f[known], low[known], high[known], color=colour, linewidth=1.6, zorder=4, **more)


def alone(values: Floats) -> NDArray[np.bool_]:
    """Known values without a known neighbour: a line plot would not show them."""
    known = np.isfinite(values)
    beside = np.zeros_like(known)
    beside[1:] |= known[:-1]
    beside[:-1] |= known[1:]
    return known & ~beside
