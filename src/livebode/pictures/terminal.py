"""A Bode plot in characters, for the terminal at the end of a run: lines of Braille dots, a circle at each line.

docs/decisions/0003-terminal-plot.md has the reasons for drawing it here.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from rich.style import Style

from livebode.arrays import Floats
from livebode.core import Response, Responses, counted
from livebode.dataclass import dataclass
from livebode.pictures import ticks, words
from livebode.pictures._style import shortened
from livebode.pictures.curves import Summary, summarised

_WIDTH_MIN, _HEIGHT_MIN = 40, 16
_BRAILLE = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_CURVE, _CIRCLE = Style(color="cyan"), Style(color="bright_yellow")
_PLAIN = str.maketrans(
    {"─": "-", "│": "|", "–": "-", "−": "-", "…": "~", "·": "*", "×": "x", "°": "deg", "²": "2", "µ": "u", "μ": "u"}
    | dict.fromkeys("┌┐└┘├┤┬┴┼", "+")
    | {"Ω": "Ohm", "ω": "w", "φ": "phi", "θ": "theta"}
)


def terminal_bode(
    responses: Responses,
    width: int = 80,
    height: int = 24,
    colour: bool = True,
    unicode: bool = True,
    *,
    mean: Response | None = None,
) -> str:
    """Magnitude in dB above phase in degrees over logarithmic frequency: the medians over the run, as text.

    Parameters
    ----------
    mean
        The average of the run; drawn instead of the medians.
    width, height
        Columns and lines of the terminal; the text is never wider or higher. Below 40 × 16, and if no response is
        valid or all are 0, one sentence replaces the plot.
    colour
        Whether to use ANSI colours.
    unicode
        False uses only ASCII, for terminals whose encoding is not UTF-8.
    """
    summary = summarised(responses if mean is None else Responses.of(mean))
    middle = f"{words.quantity(responses)}: median of {counted(summary.count, 'response')} with a valid line"
    if mean is not None:
        seconds = (mean.sample - mean.first + 1) / mean.lines.rate_hz
        middle = f"{words.quantity(responses)}: average over {seconds:.4g} s"
    if not summary.count:
        middle = f"{words.quantity(responses)}: no valid response"
    caption = written(f"{middle}, {words.lines_phrase(responses)}", width, unicode)
    drawn = summary.count and all(np.isfinite(of[1]).any() for of in (summary.magnitude_db, summary.phase_deg))
    if width < _WIDTH_MIN or height < _HEIGHT_MIN or not drawn:  # a response of 0 has neither dB nor degrees
        return caption
    picture = _picture(summary, width, height - 1, colour, unicode)
    if not unicode:
        picture = written(picture)
    return f"{caption}\n{picture}"


def _picture(summary: Summary, width: int, height: int, colour: bool, unicode: bool) -> str:
    magnitude_db, phase_deg = summary.magnitude_db[1], summary.phase_deg[1]
    upper = -(-(height - 1) * 5 // 9)  # the lower panel has one more line, the label of the frequency
    most = max((upper - 2) // 2, 2)
    ranges = [_range(magnitude_db, 1.0), _range(phase_deg, 5.0)]
    ticks_at = [ticks.linear_ticks(*ranges[0], most=most), ticks.phase_ticks(*ranges[1], most=max(most - 1, 2))]
    labels = [[f"{t:g}" for t in marks] for marks in ticks_at]
    margin = max(len(label) for panel in labels for label in panel)
    columns = width - margin - 2
    frequency = _frequency_scale(summary, columns)
    unit = words.magnitude_label(summary.responses, columns)
    lines: list[str] = []
    for values, title, rows, limits, marks in (
        (magnitude_db, unit, upper - 3, ranges[0], dict(zip(ticks_at[0], labels[0]))),
        (phase_deg, "phase in degrees", height - upper - 4, ranges[1], dict(zip(ticks_at[1], labels[1]))),
    ):
        canvas = Canvas.blank(rows, columns)
        level = CellScale(limits[1], limits[0], rows)
        _curve(canvas, frequency, level, summary.responses.lines.frequency_hz, values)
        marked = {level.cell(tick): label for tick, label in marks.items()}
        lines.append(written(title, width, unicode).center(width).rstrip())
        for row in range(rows):
            side = f"{marked.get(row, ''):>{margin}}{'┤' if row in marked else '│'}"
            lines.append(f"{side}{canvas.row(row, colour, unicode)}│")
        lines += _frequency_axis(summary, frequency, margin)
    return "\n".join([*lines, "frequency in Hz".center(width).rstrip()])


def _frequency_scale(summary: Summary, columns: int) -> CellScale:
    low_hz, high_hz = ticks.frequency_limits(summary.responses.lines.frequency_hz)
    return CellScale(float(np.log10(low_hz)), float(np.log10(high_hz)), columns)


def _frequency_axis(summary: Summary, scale: CellScale, margin: int) -> list[str]:
    """The lower edge of a panel with ticks at round frequencies, and their numbers as far as there is room."""
    edge, numbers = ["─"] * scale.cells, ""
    low_hz, high_hz = ticks.frequency_limits(summary.responses.lines.frequency_hz)
    most = max(3, min(10, scale.cells // 9))
    for tick_hz in ticks.line_ticks(summary.responses.lines.frequency_hz, low_hz, high_hz, most=most):
        column, label = scale.cell(float(np.log10(tick_hz))), ticks.frequency_label(tick_hz)
        edge[column] = "┬"
        begin = min(column - (len(label) - 1) // 2, scale.cells - len(label))
        if begin > len(numbers) or not numbers:
            numbers = numbers.ljust(begin) + label
    return [" " * margin + f"└{''.join(edge)}┘", " " * (margin + 1) + numbers]


def _curve(canvas: Canvas, frequency: CellScale, level: CellScale, frequency_hz: Floats, values: Floats) -> None:
    """Draw the curve, interrupted at lines without a value, and a circle at each line if they are few."""
    known = np.isfinite(values)
    across = frequency.dot(np.log10(frequency_hz), 2)
    down = level.dot(np.where(known, values, level.begin), 4)
    canvas.dots[down[known], across[known]] = True
    for i in np.flatnonzero(known[1:] & known[:-1]):
        ends = np.array([down[i : i + 2], across[i : i + 2]])
        share = np.linspace(0, 1, int(np.abs(np.diff(ends)).max()) + 1)
        canvas.dots[tuple(np.rint(ends[:, :1] + np.diff(ends) * share).astype(int))] = True
    if np.count_nonzero(known) <= frequency.cells // 4:
        canvas.circles[down[known] // 4, across[known] // 2] = True


def _range(values: Floats, least: float) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    margin = max(0.06 * (high - low), least)
    return low - margin, high + margin


@dataclass(frozen=True)
class CellScale:
    """Linear from the first to the last of so many cells; `begin` may be larger than `end`."""

    begin: float
    end: float
    cells: int

    def dot(self, values: Floats, of_a_cell: int) -> NDArray[np.intp]:
        """Numbers of the dots at these values, so many in each cell."""
        share = (values - self.begin) / (self.end - self.begin)
        return np.clip((share * self.cells * of_a_cell).astype(np.intp), 0, self.cells * of_a_cell - 1)

    def cell(self, value: float) -> int:
        return int(self.dot(np.array([value]), 1)[0])


@dataclass(frozen=True)
class Canvas:
    """Cells of 4 × 2 dots, and the cells with a circle."""

    dots: NDArray[np.bool_]
    circles: NDArray[np.bool_]

    @classmethod
    def blank(cls, rows: int, columns: int) -> Canvas:
        return cls(np.zeros((4 * rows, 2 * columns), bool), np.zeros((rows, columns), bool))

    def row(self, row: int, colour: bool, unicode: bool) -> str:
        """Text of a row; its parts have the colour of a curve or a circle."""
        dots = self.dots[4 * row : 4 * row + 4].reshape(4, -1, 2)
        patterns = np.tensordot(dots, _BRAILLE, ((0, 2), (0, 1)))
        curve = [(chr(0x2800 + pattern) if unicode else ".") if pattern else " " for pattern in patterns.tolist()]
        circle = "●" if unicode else "o"
        cells = [circle if circled else letter for circled, letter in zip(self.circles[row].tolist(), curve)]
        if not colour:
            return "".join(cells)
        styles = {" ": Style(), circle: _CIRCLE}
        parts = groupby(cells, lambda letter: styles.get(letter, _CURVE))
        return "".join(style.render("".join(part)) for style, part in parts)


def written(text: str, width: int | None = None, unicode: bool = False) -> str:
    """Text in at most `width` columns; without Unicode, characters outside ASCII become question marks."""
    if not unicode:
        text = text.translate(_PLAIN).encode("ascii", "replace").decode()
    if width is not None:
        text = shortened(text, width)
    return text if unicode else text.translate(_PLAIN)
