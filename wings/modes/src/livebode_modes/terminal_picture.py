"""Frequencies of the modes over time in characters, for the terminal at the end of an output-only run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.pictures import Canvas, Scale, clock, linear_ticks, written
from livebode_modes.curves import ModeCurve

_WIDTH_MIN, _HEIGHT_MIN = 40, 10


def terminal_modes(
    curves: Sequence[ModeCurve], width: int = 80, height: int = 20, colour: bool = True, unicode: bool = True
) -> str:
    """Frequency in Hz over time as text; empty below 40 × 10, and if no mode was found.

    Parameters
    ----------
    curves
        Modes and harmonics.
    width, height
        Columns and lines of the terminal; the text is never wider or higher.
    colour
        Whether to use ANSI colours.
    unicode
        False uses only ASCII.
    """
    time_s, f = (
        np.concatenate([getattr(curve, name) for curve in curves] or [np.zeros(0)])
        for name in ("time_s", "frequency_hz")
    )
    known = np.isfinite(f)
    if width < _WIDTH_MIN or height < _HEIGHT_MIN or not known.any():
        return ""
    origin_s, label = clock(time_s)
    time_s = time_s[known] - origin_s
    low, high = _limits(f[known], 0.01)
    begin, end = _limits(time_s, 0.0)
    marks = [(tick, f"{tick:g}") for tick in linear_ticks(low, high, most=max(3, height // 4))]
    margin = max(len(text) for _, text in marks)
    rows, columns = height - 5, width - margin - 2
    level, across = Scale(high, low, rows), Scale(begin, end, columns)
    canvas = Canvas.blank(rows, columns)
    canvas.dots[level.dot(f[known], 4), across.dot(time_s, 2)] = True
    marked = {level.cell(tick): text for tick, text in marks}
    lines = ["frequency in Hz".center(width).rstrip()]
    for row in range(rows):
        side = f"{marked.get(row, ''):>{margin}}{'┤' if row in marked else '│'}"
        lines.append(f"{side}{canvas.row(row, colour, unicode)}│")
    lines += _time_axis(across, begin, end, margin)
    lines.append(label.center(width).rstrip())
    text = "\n".join(lines)
    return text if unicode else written(text)


def _limits(values: np.ndarray, share: float) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    margin = max(0.05 * (high - low), share * abs(high), 1e-9)
    return low - margin * (share > 0), high + margin


def _time_axis(across: Scale, begin: float, end: float, margin: int) -> list[str]:
    edge, numbers = ["─"] * across.cells, ""
    for tick in linear_ticks(begin, end, most=max(3, across.cells // 12)):
        at, text = across.cell(tick), f"{tick:g}"
        edge[at] = "┬"
        first = min(max(at - (len(text) - 1) // 2, 0), across.cells - len(text))
        if first > len(numbers) or not numbers:
            numbers = numbers.ljust(first) + text
    return [" " * margin + f"└{''.join(edge)}┘", " " * (margin + 1) + numbers]
