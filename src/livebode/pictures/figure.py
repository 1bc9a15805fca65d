"""A picture as plain data: panels with scales, and marks in the units of the data. `vector` writes it.

The layout has room for the letters of a telephone, on which all texts are half as large again as on a desk.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.language import numerals, tr
from livebode.pictures import ticks

WIDTH = 600.0
"""Of a picture, in its own units: 12 of them are the height of its letters, 18 on a telephone."""
LETTER = 9.6
"""Mean width of a letter of text on a telephone."""
FEW_LINES = 40
"""Up to this many lines each has a marker and an error bar; more are drawn as a band."""


@dataclass(frozen=True, eq=False)
class Scale:
    """One side of a panel: its limits, its ticks with their texts, and what it shows, with the unit."""

    low: float
    high: float
    ticks: Sequence[float] = ()
    texts: Sequence[str] = ()
    minor: Sequence[float] = ()
    logarithmic: bool = False
    label: str = ""

    def share(self, values: Floats | Sequence[float] | float) -> Floats:
        """Position between the limits, 0 at the lower and 1 at the upper end; NaN for what has none."""
        given = np.asarray(values, dtype=float)
        if not self.logarithmic:
            return np.asarray((given - self.low) / (self.high - self.low))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log(given / self.low) / np.log(self.high / self.low))


@dataclass(frozen=True, eq=False)
class Trace:
    """Neighbouring points are connected; a known one without a known neighbour is a dot."""

    name: str
    x: Floats
    y: Floats
    colour: str
    width: float = 1.3
    dashes: str = ""


@dataclass(frozen=True, eq=False)
class Band:
    """The area between two curves; a bar where neither neighbour is known."""

    name: str
    x: Floats
    low: Floats
    high: Floats
    colour: str
    alpha: float = 0.22


@dataclass(frozen=True, eq=False)
class Bars:
    """A vertical stroke at each x from `low` to `high`."""

    name: str
    x: Floats
    low: Floats
    high: Floats
    colour: str
    width: float = 1.6
    alpha: float = 1.0


DotKind = Literal["dot", "ring", "dash", "plus", "square", "diamond", "up", "down"]


@dataclass(frozen=True, eq=False)
class Dots:
    """A sign at each point: a filled dot, a short horizontal stroke, a cross, triangles, or an outline."""

    name: str
    x: Floats
    y: Floats
    colour: str
    size: float = 4.5
    kind: DotKind = "dot"
    alpha: float = 1.0


@dataclass(frozen=True, eq=False)
class Areas:
    """Filled regions, as the corners (x, y) of each."""

    name: str
    corners: Sequence[tuple[Floats, Floats]]
    colour: str
    alpha: float = 0.25


@dataclass(frozen=True, eq=False)
class Shade:
    """The full height of the panel from each of `low` to `high`."""

    name: str
    low: Floats
    high: Floats
    colour: str
    alpha: float = 0.6


@dataclass(frozen=True, eq=False)
class Cells:
    """A colour for each value, (columns, rows): columns between equidistant `x`, rows between the edges `y`.

    NaN is grey. `change` is transparent at the middle of its limits, so that it fits light and dark paper.
    """

    name: str
    x: tuple[float, float]
    y: Floats
    values: Floats
    limits: tuple[float, float]
    colours: Literal["level", "change"] = "level"


@dataclass(frozen=True, eq=False)
class Note:
    """A sentence in the middle of a panel."""

    text: str


@dataclass(frozen=True, eq=False)
class Tag:
    """A text above a point, centred, or beginning or ending there."""

    text: str
    x: float
    y: float
    colour: str
    anchor: Literal["start", "middle", "end"] = "middle"


Mark = Trace | Band | Bars | Dots | Areas | Shade | Cells | Note | Tag


@dataclass(frozen=True, eq=False)
class End:
    """A text beside the right edge of a panel, with a line to the value that it belongs to."""

    text: str
    value: float
    colour: str


@dataclass(frozen=True, eq=False)
class Panel:
    """Marks in a frame. Its place is in units of the picture, from the upper left below the head.

    The label of `y` is above the panel, where it can be read without turning the head, and the title above it.
    `right` has its ticks at the right, as those of a bar of colours.
    """

    left: float
    top: float
    width: float
    height: float
    x: Scale
    y: Scale
    marks: Sequence[Mark]
    ends: Sequence[End] = ()
    right: bool = False
    grid: bool = True
    title: str = ""


@dataclass(frozen=True, eq=False)
class Entry:
    """One line of the key: how something is drawn, and what it is."""

    text: str
    colour: str
    kind: Literal["line", "dashed", "dotted", "band", "bar"] | DotKind = "line"


@dataclass(frozen=True, eq=False)
class Figure:
    """A picture: title, facts and key above its panels, which are `height` high together with their labels."""

    title: str
    facts: Sequence[str]
    key: Sequence[Entry]
    panels: Sequence[Panel]
    height: float
    width: float = WIDTH

    def marks(self, name: str) -> list[Mark]:
        """All marks of this name, in the order of the panels."""
        return [mark for panel in self.panels for mark in panel.marks if getattr(mark, "name", "") == name]


TITLE, ABOVE, BELOW = 22.0, 26.0, 46.0
"""Room above a panel for its title, and for the label of its y; and below it for numbers and label of its x."""


def room(*scales: Scale) -> float:
    """Width of the longest text of the ticks, with what is between it and the panel."""
    letters = max((len(text) for scale in scales for text in scale.texts), default=0)
    return 13.0 + 10.6 * letters  # digits are wide


def end_room(ends: Sequence[End]) -> float:
    """Width of the texts at the right edge with the lines to them; of long ones, only their ends are shown."""
    return 15.0 + LETTER * max((min(len(end.text), 16) for end in ends), default=0)


def stacked(
    x: Scale,
    parts: Sequence[tuple[Scale, Sequence[Mark], float]],
    *,
    left: float,
    width: float,
    top: float = 0.0,
    title: str = "",
) -> tuple[list[Panel], float]:
    """Panels below each other, (y, marks, height) each, with one x; its numbers are below the last. And their height.

    The first has the title, for which there is no room yet.
    """
    panels = []
    for i, (y, marks, height) in enumerate(parts):
        top += ABOVE
        last = i == len(parts) - 1
        below = x if last else unlabelled(x)
        panels.append(Panel(left, top, width, height, below, y, marks, title="" if i else title))
        top += height
    return panels, top + BELOW


def unlabelled(scale: Scale) -> Scale:
    """The scale without texts, for a panel beside or above one that has them."""
    return Scale(scale.low, scale.high, scale.ticks, (), scale.minor, scale.logarithmic)


def frequency_scale(frequency_hz: Floats, most: int = 8) -> Scale:
    """Logarithmic frequency around these lines, with numbers at the lines themselves where there is room."""
    low_hz, high_hz = ticks.frequency_limits(frequency_hz)
    plain = round_frequency_scale(low_hz, high_hz)
    major = ticks.line_ticks(frequency_hz, low_hz, high_hz, most)
    texts = [numerals(ticks.frequency_label(f)) for f in major]
    return Scale(low_hz, high_hz, major, texts, plain.minor, True, plain.label)


def round_frequency_scale(low_hz: float, high_hz: float, most: int = 8) -> Scale:
    """Logarithmic frequency between these limits, with round numbers."""
    major = ticks.frequency_ticks(low_hz, high_hz, most)
    return Scale(
        low_hz, high_hz, major, [numerals(ticks.frequency_label(f)) for f in major],
        ticks.minor_frequency_ticks(low_hz, high_hz), True, tr("frequency in Hz"),
    )  # fmt: skip


def value_scale(low: float, high: float, label: str, most: int = 6) -> Scale:
    """A linear scale with round numbers; limits that are equal are moved apart."""
    if not high > low:
        low, high = low - (abs(low) or 1.0) * 1e-3, high + (abs(high) or 1.0) * 1e-3
    major = ticks.linear_ticks(low, high, most)
    return Scale(low, high, major, [number_text(value) for value in major], label=label)


def scale_around(values: Sequence[Floats], label: str, most: int = 6, low: float | None = None) -> Scale:
    """A linear scale with a little room around all known values; `low` is its lower end, as 0."""
    known = np.concatenate(values) if values else np.zeros(0)
    known = known[np.isfinite(known)] if np.isfinite(known).any() else np.array([0.0, 1.0])
    first, last = float(known.min()) if low is None else low, float(known.max())
    margin = 0.05 * (last - first)
    return value_scale(first - margin * (low is None), last + margin, label, most)


def phase_scale(low_deg: float, high_deg: float, label: str = "", most: int = 6) -> Scale:
    """Degrees in steps that divide a quarter turn; its label is by default that of a phase."""
    major = ticks.phase_ticks(low_deg, high_deg, most)
    texts = [number_text(value) for value in major]
    return Scale(low_deg, high_deg, major, texts, label=label or tr("phase in degrees"))


def empty_scale(label: str = "") -> Scale:
    """A scale without numbers, where nothing can be drawn."""
    return Scale(0.0, 1.0, label=label)


def number_text(value: float) -> str:
    """A tick's number in the language in use, with the sign for minus.

    >>> number_text(-0.25)
    '−0.25'
    """
    return numerals(f"{value:.10g}").replace("-", "−")


def limits_around(drawn: Floats, around: Floats, room: float) -> tuple[float, float] | None:
    """Limits that contain `drawn`, and `around` as far as it leaves room for the rest; None if nothing is known."""
    drawn, around = drawn[np.isfinite(drawn)], around[np.isfinite(around)]
    if not drawn.size:
        return None
    low, high = float(drawn.min()), float(drawn.max())
    reach = max(0.35 * (high - low), room)
    low, high = max(float(around.min(initial=low)), low - reach), min(float(around.max(initial=high)), high + reach)
    margin = max(0.04 * (high - low), room / 3)
    return low - margin, high + margin


def alone(values: Floats) -> NDArray[np.bool_]:
    """Known values without a known neighbour: a line would not show them."""
    known = np.isfinite(values)
    beside = np.zeros_like(known)
    beside[1:] |= known[:-1]
    beside[:-1] |= known[1:]
    return known & ~beside
