"""The look of the studies' figures: the colours of livebode's own pictures, on axes of Matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from livebode.pictures import LIGHT, Style, columns, shortened

__all__ = ["LIGHT", "figure_of", "spread"]

HEAD_IN = 0.85
_DPI = 110


@contextmanager
def figure_of(title: str, facts: str, size_in: tuple[float, float]) -> Iterator[Figure]:
    """An empty figure with the head that every picture has; laid out at the end."""
    with _drawing(LIGHT):
        figure = _new_figure(*size_in)
        yield figure
        for axes in figure.axes:
            axes.set_axisbelow(True)
            axes.grid(True, linewidth=0.7)
        figure.tight_layout(rect=(0, 0, 1, 1 - HEAD_IN / size_in[1]))
        _heading(figure, LIGHT, title, facts, 0.2 / size_in[0])


def spread(heights: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Ascending heights of labels, moved apart to at least this distance."""
    moved = np.array(heights, dtype=np.float64)
    for i in range(1, len(moved)):
        moved[i] = max(moved[i], moved[i - 1] + least)
    return moved - np.mean(moved - heights)


@contextmanager
def _drawing(look: Style) -> Iterator[None]:
    """Use Matplotlib's defaults with this look, whatever the user's matplotlibrc is; restore settings afterwards."""
    settings: Any = {k: v for k, v in matplotlib.rcParamsDefault.items() if not k.startswith("backend")}
    settings |= {
        "axes.edgecolor": look.muted,
        "axes.facecolor": look.paper,
        "axes.labelcolor": look.ink,
        "axes.labelsize": 10.0,
        "axes.linewidth": 0.8,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.unicode_minus": True,
        "figure.facecolor": look.paper,
        "font.family": ["sans-serif"],
        "font.sans-serif": ["DejaVu Sans"],
        "font.size": 10.0,
        "grid.color": look.grid,
        "legend.fontsize": 9.0,
        "legend.frameon": False,
        "legend.labelcolor": look.ink,
        "path.simplify": True,
        "text.color": look.ink,
        "text.hinting": "no_hinting",  # a tenth of a picture's time; at this size text is as legible without
        "text.parse_math": False,
        "text.usetex": False,
        "xtick.color": look.muted,
        "xtick.labelcolor": look.ink,
        "xtick.labelsize": 9.0,
        "ytick.color": look.muted,
        "ytick.labelcolor": look.ink,
        "ytick.labelsize": 9.0,
    }
    with matplotlib.rc_context(settings):
        yield


def _new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure on an Agg canvas."""
    figure = Figure(figsize=(width_in, height_in), dpi=_DPI)
    FigureCanvasAgg(figure)
    return figure


def _heading(figure: Figure, look: Style, title: str, facts: str, left: float) -> None:
    """Draw title and a line of facts at the upper left, in inches from the top."""
    width_in, height_in = figure.get_size_inches()
    for text, down_in, size, weight, colour in (
        (title, 0.36, 13, "bold", look.ink),
        (facts, 0.62, 9.5, "normal", look.muted),
    ):
        line = figure.text(left, 1 - down_in / height_in, "", size=size, weight=weight, color=colour, parse_math=False)
        _fit(line, shortened(text, 300), ((1 - left) * width_in - 0.2) * _DPI)


def _fit(line: Text, text: str, width_px: float) -> None:
    """Draw `text`, shortened to at most `width_px`."""
    line.set_text(text)
    while len(text) > 8 and (measured := line.get_window_extent().width) > width_px:
        text = shortened(text, min(columns(text) - 1, int(columns(text) * width_px / measured)))
        line.set_text(text)
