"""Light and dark: colours and sizes of every picture, and the preparation of text from data.

Figures use Matplotlib's objects, never pyplot, and Matplotlib is imported when a picture is drawn, so that the import
of livebode is cheap. The settings of a program that uses Matplotlib itself do not change.
"""

from __future__ import annotations

import unicodedata
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from livebode.core import needing
from livebode.language import tr

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

DPI = 110


@dataclass(frozen=True)
class Style:
    """Colours of one look, after Okabe and Ito, which people with colour-vision deficiency can distinguish.

    `run` and `newest` are the colours of the Bode plot, `traces` those of the lines of the tracking plot, in an order
    in which neighbours differ most.
    """

    paper: str
    ink: str
    muted: str
    grid: str
    run: str
    newest: str
    nothing: str
    change_map: str
    traces: tuple[str, ...]


LIGHT = Style(
    paper="#ffffff",
    ink="#1d2733",
    muted="#5b6775",
    grid="#e3e7ec",
    run="#0072b2",
    newest="#d55e00",
    nothing="#d9dde2",
    change_map="RdBu_r",
    traces=(
        *("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#1d2733"),
        *("#56b4e9", "#d55e00", "#a39a00", "#6a3d9a", "#8c564b"),
    ),
)
DARK = Style(
    paper="#12181f",
    ink="#e8edf2",
    muted="#a3afbc",
    grid="#2a333d",
    run="#56b4e9",
    newest="#f0a04b",
    nothing="#39424c",
    change_map="berlin",
    traces=(
        *("#4aa3df", "#e69f00", "#1fc297", "#e29ac4", "#e8edf2"),
        *("#8fd3ff", "#f0723a", "#f0e442", "#b497e7", "#c49a8a"),
    ),
)


_IN_USE: ContextVar[Style | None] = ContextVar("look", default=None)
"""The look of the settings at this moment: to check and restore 300 of them takes a hundredth of a picture's time."""


def style(dark: bool) -> Style:
    return DARK if dark else LIGHT


@contextmanager
def drawing(look: Style) -> Iterator[None]:
    """Use Matplotlib's defaults with this look, whatever the user's matplotlibrc is; restore settings afterwards."""
    if _IN_USE.get() is look:
        yield
        return
    with needing("Matplotlib", "plots", "a picture"):
        import matplotlib

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
    before = _IN_USE.set(look)
    try:
        with matplotlib.rc_context(settings):
            yield
    finally:
        _IN_USE.reset(before)


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure on an Agg canvas."""
    with needing("Matplotlib", "plots", "a picture"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def heading(figure: Figure, look: Style, title: str, facts: str, left: float) -> None:
    """Draw title and a line of facts at the upper left, in inches from the top: all pictures have the same head."""
    width_in, height_in = figure.get_size_inches()
    for text, down_in, size, weight, colour in (
        (title, 0.36, 13, "bold", look.ink),
        (facts, 0.62, 9.5, "normal", look.muted),
    ):
        line = figure.text(left, 1 - down_in / height_in, "", size=size, weight=weight, color=colour, parse_math=False)
        _fit(line, shortened(text, 300), ((1 - left) * width_in - 0.2) * DPI)


def _fit(line: Text, text: str, width_px: float) -> None:
    """Draw `text`, shortened to at most `width_px`."""
    line.set_text(text)
    with quiet_about_letters():
        while len(text) > 8 and (measured := line.get_window_extent().width) > width_px:
            text = shortened(text, min(columns(text) - 1, int(columns(text) * width_px / measured)))
            line.set_text(text)


@contextmanager
def quiet_about_letters() -> Iterator[None]:
    """Suppress warnings about characters that the font lacks: names from data may contain them; they show as boxes."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def plain(axes: Axes, grid: bool = True) -> None:
    """Set the look of one panel: a light grid behind the data."""
    axes.set_axisbelow(True)
    if grid:
        axes.grid(True, linewidth=0.7)


def empty_note(axes: Axes, look: Style) -> None:
    axes.text(
        0.5, 0.5, tr("no valid response"), transform=axes.transAxes, ha="center", va="center", size=12, color=look.muted
    )


def shortened(text: str, letters: int) -> str:
    """One line of at most `letters` columns: control characters become spaces, and the middle is removed.

    >>> shortened("a channel with a long name", 15)
    'a chann…ng name'
    """
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    if columns(text) <= letters:
        return text
    head = tail = ""
    middle = text
    while middle:
        if columns(head) <= columns(tail):
            head, middle = head + middle[0], middle[1:]
        else:
            tail, middle = middle[-1] + tail, middle[:-1]
        if columns(head) + columns(tail) >= letters - 1:
            break
    return f"{head}…{tail}"


def wide_letters(text: str) -> int:
    """Number of wide (East Asian) letters, which the fonts of Matplotlib lack: they are measured too narrow."""
    return sum(unicodedata.east_asian_width(c) in "WF" for c in text)


def columns(text: str) -> int:
    """Width in columns of a terminal or in letters of normal width; wide (East Asian) letters count twice."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 0 if unicodedata.combining(c) else 1 for c in text)
