"""A Figure as SVG: text remains text, and it refers to nothing outside of it.

The colours are those of light paper, as attributes that every program reads; `style_rules` replaces them on a dark
screen and enlarges the letters on a telephone. A panel is a nested picture in tenths of a unit, which clips what is
outside of it, so that nothing has a name that another picture of the page could have.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import write_whole
from livebode.pictures import figure as described
from livebode.pictures._style import DARK, LIGHT, columns, shortened
from livebode.pictures.figure import LETTER, Entry, Figure, Mark, Panel, alone
from livebode.pictures.raster import cells_png, data_url

Integers = NDArray[np.int64]

FONTS = "system-ui, 'Segoe UI', 'Noto Sans', 'DejaVu Sans', sans-serif"
_TITLE, _TEXT, _SMALL = 14.0, 12.0, 11.0  # sizes of letters
_ON_TELEPHONE = 1.5
_LINE = 20.0  # height of a line of text on a telephone
_FINE = 10.0  # of a unit: the units of what is in a panel
_FAR = 3.0  # heights of a panel: what is farther outside is moved there
_MANY = 600  # points; with more, those that share a unit are joined
_DASHES = {"": "", "dashed": "40 20", "dotted": "15 15", "mixed": "50 20 15 20"}
_SAMPLE = 24.0  # width of a sample in the key


def svg(figure: Figure, label: str = "") -> str:
    """The picture as an element of a page, or as a file in colours for white paper.

    Parameters
    ----------
    figure
        What is drawn.
    label
        Text alternative for screen readers; default: the title.
    """
    head, top = _head(figure)
    height = top + figure.height
    panels = "".join(_panel(panel, top) for panel in figure.panels)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="figure" viewBox="0 0 {_n(figure.width)} {_n(height)}" '
        f'role="img" aria-label="{_text(label or figure.title)}" font-family="{FONTS}">'
        f'<rect width="100%" height="100%" fill="{LIGHT.paper}"/>{head}{panels}</svg>'
    )


def svg_file(figure: Figure) -> str:
    """The picture as a file of its own, which follows the light or dark setting of the system."""
    start, _, inside = svg(figure).partition(">")
    return f"{start}><style>{style_rules()}</style>{inside}\n"


def save_svg(figure: Figure, path: Path) -> Path:
    """Write a picture; the same one gives the same bytes. OSError, and nothing has changed, if it is not written."""
    write_whole(path, svg_file(figure).encode())
    return path


def style_rules() -> str:
    """Rules for all pictures of a page: colours on a dark screen, and the size of letters on a telephone."""
    names = ("paper", "ink", "muted", "grid", "nothing", "run", "newest")
    pairs = dict(zip(LIGHT.traces, DARK.traces)) | {getattr(LIGHT, name): getattr(DARK, name) for name in names}
    dark = "".join(
        f'.figure [fill="{light}"]{{fill:{own}}}.figure [stroke="{light}"]{{stroke:{own}}}'
        for light, own in pairs.items()
    )
    large = "".join(
        f'.figure [font-size="{_n(size)}"]{{font-size:{_n(size * _ON_TELEPHONE)}px}}' for size in (_TEXT, _SMALL)
    )
    return (
        f"@media screen and (prefers-color-scheme:dark){{{dark}}}"
        f'@media screen and (max-width:520px){{{large}.figure [font-size="{_n(_TITLE)}"]{{font-size:19px}}}}'
    )


def _head(figure: Figure) -> tuple[str, float]:
    """Title, facts and key, and their height."""
    left = 8.0
    letters = int((figure.width - 2 * left) / LETTER)
    parts, y = [], 4.0
    if figure.title:
        y += _LINE
        parts.append(_words(left, y, shortened(figure.title, letters), _TITLE, LIGHT.ink, bold=True))
    for line in _wrapped([shortened(fact, letters) for fact in figure.facts], " · ", letters):
        y += _LINE
        parts.append(_words(left, y, line, _SMALL, LIGHT.muted))
    x, y = left, y + _LINE * bool(figure.key)
    for entry in figure.key:
        text = shortened(entry.text, letters - 4)
        width = _SAMPLE + 6 + LETTER * columns(text) + 12
        if x > left and x + width > figure.width:
            x, y = left, y + _LINE
        parts.append(_sample(entry, x, y - 4) + _words(x + _SAMPLE + 6, y, text, _SMALL, LIGHT.ink))
        x += width
    return "".join(parts), y + 4.0


def _wrapped(pieces: Sequence[str], between: str, letters: int) -> list[str]:
    lines: list[str] = []
    for piece in pieces:
        if lines and columns(lines[-1]) + len(between) + columns(piece) <= letters:
            lines[-1] += between + piece
        else:
            lines.append(piece)
    return lines


def _sample(entry: Entry, x: float, y: float) -> str:
    """How an entry of the key is drawn, in the line at `y`."""
    right, middle, colour = x + _SAMPLE, x + _SAMPLE / 2, entry.colour
    if entry.kind == "band":
        return f'<rect x="{_n(x)}" y="{_n(y - 5)}" width="{_n(_SAMPLE)}" height="10" fill="{colour}" opacity="0.3"/>'
    if entry.kind in ("dot", "ring"):
        fill = colour if entry.kind == "dot" else LIGHT.paper
        return f'<circle cx="{_n(middle)}" cy="{_n(y)}" r="3.2" fill="{fill}" stroke="{colour}"/>'
    width, dash = (
        1.8,
        {"dashed": ' stroke-dasharray="4 2"', "dotted": ' stroke-dasharray="1.5 1.5"'}.get(entry.kind, ""),
    )
    if entry.kind in ("bar", "dash"):
        path = f"M{_n(middle)} {_n(y - 7)}v14M{_n(middle - 6)} {_n(y)}h12"
    elif entry.kind in _SIGNS:
        path = f"M{_n(middle)} {_n(y)}{_sign(entry.kind, 8)}"
    else:
        path = f"M{_n(x)} {_n(y)}H{_n(right)}"
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>'


def _panel(panel: Panel, head: float) -> str:
    top = head + panel.top
    inside = "".join(_Inside(panel).drawn(mark) for mark in panel.marks)
    box = f'x="{_n(panel.left)}" y="{_n(top)}" width="{_n(panel.width)}" height="{_n(panel.height)}"'
    view = f'viewBox="0 0 {_n(panel.width * _FINE)} {_n(panel.height * _FINE)}"'
    frame = f"M{_n(panel.left)} {_n(top)}v{_n(panel.height)}h{_n(panel.width)}"
    return (
        f'<svg {box} {view} preserveAspectRatio="none">{_grid(panel) if panel.grid else ""}{inside}</svg>'
        f'<path d="{frame}{_ticks(panel, top)}" fill="none" stroke="{LIGHT.muted}" stroke-width="0.8"/>'
        f"{_tick_texts(panel, top)}{_ends(panel, top)}"
    )


def _grid(panel: Panel) -> str:
    width, height = panel.width * _FINE, panel.height * _FINE
    across = "".join(f"M{_n(x * width)} 0v{_n(height)}" for x in panel.x.share(panel.x.ticks))
    down = "".join(f"M0 {_n((1 - y) * height)}h{_n(width)}" for y in panel.y.share(panel.y.ticks))
    return f'<path d="{across}{down}" fill="none" stroke="{LIGHT.grid}" stroke-width="7"/>' if across or down else ""


def _ticks(panel: Panel, top: float) -> str:
    bottom, edge = top + panel.height, panel.left + panel.width * panel.right
    out = 3 if panel.right else -3
    x = [f"M{_n(panel.left + s * panel.width)} {_n(bottom)}v3.5" for s in panel.x.share(panel.x.ticks)]
    minor = [f"M{_n(panel.left + s * panel.width)} {_n(bottom)}v2" for s in panel.x.share(panel.x.minor)]
    y = [f"M{_n(edge)} {_n(bottom - s * panel.height)}h{out}" for s in panel.y.share(panel.y.ticks)]
    return "".join((*x, *minor, *y))


def _tick_texts(panel: Panel, top: float) -> str:
    """Numbers of both scales and their labels."""
    bottom, right = top + panel.height, panel.left + panel.width
    parts = []
    for share, text in zip(panel.x.share(panel.x.ticks), panel.x.texts):
        parts.append(_words(panel.left + share * panel.width, bottom + 17, text, _SMALL, LIGHT.ink, "middle"))
    for share, text in zip(panel.y.share(panel.y.ticks), panel.y.texts):
        x, anchor = (right + 6, "start") if panel.right else (panel.left - 6, "end")
        parts.append(_words(x, bottom - share * panel.height + 4, text, _SMALL, LIGHT.ink, anchor))
    if panel.x.label:
        middle = panel.left + panel.width / 2
        letters = int(2 * min(middle, described.WIDTH) / LETTER)
        parts.append(_words(middle, bottom + 37, shortened(panel.x.label, letters), _TEXT, LIGHT.ink, "middle"))
    if panel.y.label:
        x, anchor = (right, "end") if panel.right else (panel.left, "start")
        letters = int(((right if panel.right else panel.width) + 20) / LETTER)
        parts.append(_words(x, top - 8, shortened(panel.y.label, letters), _TEXT, LIGHT.ink, anchor))
    if panel.title:
        text = shortened(panel.title, int((panel.width + 20) / LETTER))
        parts.append(
            _words(panel.left, top - 8 - described.TITLE * bool(panel.y.label), text, _TEXT, LIGHT.ink, bold=True)
        )
    for mark in panel.marks:
        if isinstance(mark, described.Tag):
            x, y = (
                panel.left + panel.width * float(panel.x.share(mark.x)),
                bottom - panel.height * float(panel.y.share(mark.y)),
            )
            parts.append(_words(x, y - 5, shortened(mark.text, 44), _SMALL, mark.colour, mark.anchor))
    parts += [_words(panel.left + panel.width / 2, top + panel.height / 2, shortened(mark.text, 50), _TEXT, LIGHT.muted,
                     "middle") for mark in panel.marks if isinstance(mark, described.Note)]  # fmt: skip
    return "".join(parts)


def _ends(panel: Panel, top: float) -> str:
    """The texts at the right edge, moved apart where they would overlap."""
    if not panel.ends:
        return ""
    right, bottom = panel.left + panel.width, top + panel.height
    at = panel.y.share([end.value for end in panel.ends]).clip(0, 1)
    parts = []
    for end, share, place in zip(panel.ends, at, spread(at, 18.0 / panel.height)):
        line = (
            f"M{_n(right + 1)} {_n(bottom - share * panel.height)}L{_n(right + 12)} {_n(bottom - place * panel.height)}"
        )
        parts.append(f'<path d="{line}" fill="none" stroke="{end.colour}" stroke-width="0.8"/>')
        text = shortened(end.text, max(int((described.WIDTH - right - 15) / LETTER), 3))
        parts.append(_words(right + 15, bottom - place * panel.height + 4, text, _SMALL, end.colour, bold=True))
    return "".join(parts)


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


class _Inside:
    """The marks of one panel, in tenths of a unit from its upper left corner."""

    def __init__(self, panel: Panel) -> None:
        self._of = panel
        self._width, self._height = panel.width * _FINE, panel.height * _FINE

    def drawn(self, mark: Mark) -> str:
        """The mark as elements."""
        match mark:
            case described.Trace():
                return self._line(mark)
            case described.Band():
                return self._band(mark)
            case described.Bars():
                return self._bars(mark)
            case described.Dots():
                return self._dots(mark)
            case described.Areas():
                return self._areas(mark)
            case described.Shade():
                return self._shade(mark)
            case described.Cells():
                return self._cells(mark)
        return ""

    def _x(self, values: Floats) -> Floats:
        return self._tenths(self._of.x.share(values) * self._width, self._width)

    def _y(self, values: Floats) -> Floats:
        return self._tenths((1 - self._of.y.share(values)) * self._height, self._height)

    def _tenths(self, values: Floats, size: float) -> Floats:
        with np.errstate(invalid="ignore"):
            return np.rint(np.clip(values, -_FAR * size, (1 + _FAR) * size))

    def _line(self, mark: described.Trace) -> str:
        x, y = self._x(mark.x), self._y(mark.y)
        points = x + y  # NaN where either is
        path = "".join(_path(*_joined(x[run], y[run])) for run in _runs(points) if run.stop - run.start > 1)
        single = alone(points)
        dots = "".join(f"M{a:.0f} {b:.0f}h0" for a, b in zip(x[single], y[single]))
        dashes = f' stroke-dasharray="{_DASHES[mark.dashes]}"' if mark.dashes else ""
        return _stroked(mark.name, path, mark.colour, 10 * mark.width, f'{dashes} stroke-linejoin="round"') + _stroked(
            mark.name, dots, mark.colour, 30, ' stroke-linecap="round"'
        )

    def _band(self, mark: described.Band) -> str:
        x, low, high = self._x(mark.x), self._y(mark.low), self._y(mark.high)
        known = x + low + high
        areas = []
        for run in _runs(known):
            if run.stop - run.start > 1:
                (xs, lows, highs) = _narrowed(x[run], low[run], high[run])
                areas.append(_path(np.append(xs, xs[::-1]), np.append(highs, lows[::-1])) + "z")
        single = np.flatnonzero(alone(known))
        bars = "".join(f"M{x[i]:.0f} {low[i]:.0f}V{high[i]:.0f}" for i in single)
        area = "".join(areas)
        return _filled(mark, area) + _stroked(
            mark.name, bars, mark.colour, 60, f' stroke-opacity="{1.5 * mark.alpha:g}"'
        )

    def _bars(self, mark: described.Bars) -> str:
        x, low, high = _distinct(np.column_stack([self._x(mark.x), self._y(mark.low), self._y(mark.high)])).T
        path = _strokes(x, low, high - low, "v")
        opacity = f' stroke-opacity="{mark.alpha:.3g}"' if mark.alpha < 1 else ""
        return _stroked(mark.name, path, mark.colour, 10 * mark.width, opacity)

    def _dots(self, mark: described.Dots) -> str:
        x, y = _distinct(np.column_stack([self._x(mark.x), self._y(mark.y)])).T
        size, opacity = 10 * mark.size, f' stroke-opacity="{mark.alpha:g}"' * (mark.alpha < 1)
        if mark.kind == "dash":
            half = int(size)
            return _stroked(mark.name, _strokes(x - half, y, np.full(len(x), 2 * half), "h"), mark.colour, 20)
        if mark.kind in _SIGNS:
            sign = _sign(mark.kind, size)
            return _stroked(mark.name, "".join(f"M{a} {b}{sign}" for a, b in zip(x, y)), mark.colour, 16)
        path = _strokes(x, y, np.zeros_like(x), "h")
        dots = _stroked(mark.name, path, mark.colour, size, f' stroke-linecap="round"{opacity}')
        if mark.kind == "ring":
            dots += _stroked("", path, LIGHT.paper, size - 16, ' stroke-linecap="round"')
        return dots

    def _areas(self, mark: described.Areas) -> str:
        shapes = ((self._x(x), self._y(y)) for x, y in mark.corners)
        path = "".join(f"{_path(x, y)}z" for x, y in shapes if np.isfinite(x + y).all())
        return _filled(mark, path)

    def _shade(self, mark: described.Shade) -> str:
        ends = zip(self._x(mark.low), self._x(mark.high))
        path = "".join(f"M{low:.0f} 0H{high:.0f}V{self._height:.0f}H{low:.0f}z" for low, high in ends)
        return _filled(mark, path)

    def _cells(self, mark: described.Cells) -> str:
        y, count = self._of.y, max(int(2 * self._of.height), 2)
        share = (np.arange(count) + 0.5) / count
        rows = y.low * (y.high / y.low) ** share if y.logarithmic else y.low + (y.high - y.low) * share
        left, right = self._x(np.array(mark.x))
        return (
            f'<image class="{mark.name}" x="{left:.0f}" y="0" width="{right - left:.0f}" height="{self._height:.0f}" '
            f'preserveAspectRatio="none" image-rendering="pixelated" href="{data_url(cells_png(mark, rows))}"/>'
        )


_SIGNS: Mapping[str, Sequence[tuple[str, int, int]]] = {
    "plus": (("m", -1, 0), ("l", 2, 0), ("m", -1, -1), ("l", 0, 2)),
    "square": (("m", -1, -1), ("l", 2, 0), ("l", 0, 2), ("l", -2, 0), ("l", 0, -2)),
    "diamond": (("m", 0, -1), ("l", 1, 1), ("l", -1, 1), ("l", -1, -1), ("l", 1, -1)),
    "up": (("m", -1, 1), ("l", 1, -2), ("l", 1, 2), ("l", -2, 0)),
    "down": (("m", -1, -1), ("l", 1, 2), ("l", 1, -2), ("l", -2, 0)),
}
"""Outlines around a point, in halves of the size."""


def _sign(kind: str, size: float) -> str:
    return "".join(f"{step}{_n(x * size / 2)} {_n(y * size / 2)}" for step, x, y in _SIGNS[kind])


def _stroked(name: str, path: str, colour: str, width: float, more: str = "") -> str:
    named = f' class="{name}"' if name else ""
    return f'<path{named} d="{path}" fill="none" stroke="{colour}" stroke-width="{_n(width)}"{more}/>' if path else ""


def _filled(mark: described.Band | described.Areas | described.Shade, path: str) -> str:
    shape = f'<path class="{mark.name}" d="{path}" fill="{mark.colour}" fill-opacity="{mark.alpha:g}"/>'
    return shape if path else ""


def _runs(values: Floats) -> Iterable[slice]:
    """The parts between values that are not known."""
    known = np.concatenate([[False], np.isfinite(values), [False]])
    edges = np.flatnonzero(known[1:] != known[:-1])
    return (slice(a, b) for a, b in edges.reshape(-1, 2))


def _path(x: Floats, y: Floats) -> str:
    """Points as a path: the first, and the steps to the others."""
    at: Integers = np.column_stack([x, y]).astype(np.int64)
    steps = " ".join(map(str, np.diff(at, axis=0).ravel().tolist())).replace(" -", "-")
    return f"M{at[0, 0]} {at[0, 1]}l{steps}"


def _columns_of(x: Floats) -> Integers | None:
    """Where each unit begins that has points; None if there are few points, or they turn back."""
    if len(x) <= _MANY or np.any(np.diff(x) < 0):
        return None
    return np.flatnonzero(np.diff(np.floor(x / _FINE), prepend=-1e9))


def _joined(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The points, or of many the lowest and the highest in each unit: as much as can be seen."""
    starts = _columns_of(x)
    if starts is None:
        return x, y
    low, high = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    ends = np.append(starts[1:], len(y)) - 1
    rising = y[ends] >= y[starts]
    pairs = np.column_stack([np.where(rising, low, high), np.where(rising, high, low)])
    return np.column_stack([x[starts], x[ends]]).ravel(), pairs.ravel()


def _narrowed(x: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """The ends of a band, or of many the outermost in each unit; y points down."""
    starts = _columns_of(x)
    if starts is None:
        return x, low, high
    return x[starts], np.maximum.reduceat(low, starts), np.minimum.reduceat(high, starts)


def _distinct(at: Floats) -> Integers:
    """The known rows as integers from left to right; of many, one for each unit."""
    known: Integers = at[np.isfinite(at).all(axis=1)].astype(np.int64)
    if len(known) > _MANY:
        known = known[np.unique(known // int(_FINE), axis=0, return_index=True)[1]]
    return known[np.argsort(known[:, 0], kind="stable")]


def _strokes(x: Integers, y: Integers, length: Integers, direction: Literal["h", "v"]) -> str:
    """A stroke from each point; each begins at a step from the end of the one before."""
    end_x, end_y = (x + length, y) if direction == "h" else (x, y + length)
    right, down = (start - np.append(0, end)[: len(start)] for start, end in ((x, end_x), (y, end_y)))
    return "".join(f"m{a} {b}{direction}{c}" for a, b, c in zip(right, down, length)).replace(" -", "-")


def _words(
    x: float, y: float, text: str, size: float, colour: str, anchor: str = "start", *, bold: bool = False
) -> str:
    """One line of text; `text` is from data."""
    more = f' text-anchor="{anchor}"' * (anchor != "start") + ' font-weight="bold"' * bold
    return f'<text x="{_n(x)}" y="{_n(y)}" font-size="{_n(size)}" fill="{colour}"{more}>{_text(text)}</text>'


def _text(text: str) -> str:
    return escape(shortened(text, 300))


def _n(value: float) -> str:
    """At most one decimal."""
    return f"{value:.1f}".removesuffix(".0")
