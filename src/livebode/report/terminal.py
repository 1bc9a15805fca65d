"""A Bode plot in characters, for the terminal at the end of a run.

plotext draws on a separate figure with a separate terminal object, so no state remains in its module-wide figure, and
two calls give the same text.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Responses, counted
from livebode.drawing import ticks
from livebode.report import words
from livebode.report.style import shortened
from livebode.report.summary import Summary, summarised

Floats = NDArray[np.float64]

_WIDTH_MIN, _HEIGHT_MIN = 40, 16
_PLAIN = str.maketrans(
    {"─": "-", "│": "|", "–": "-", "−": "-", "…": "~", "·": "*", "×": "x", "°": "deg", "²": "2", "µ": "u", "μ": "u"}
    | dict.fromkeys("┌┐└┘├┤┬┴┼", "+")
    | {"Ω": "Ohm", "ω": "w", "φ": "phi", "θ": "theta"}
)


def terminal_bode(
    responses: Responses, width: int = 80, height: int = 24, colour: bool = True, unicode: bool = True
) -> str:
    """Magnitude in dB above phase in degrees over logarithmic frequency: the medians over the run, as text.

    Parameters
    ----------
    width, height
        Columns and lines of the terminal; the text is never wider or higher. Below 40 × 16, and if no response is
        valid, one sentence replaces the plot.
    colour
        Whether to use ANSI colours.
    unicode
        False uses only ASCII, for terminals whose encoding is not UTF-8.
    """
    summary = summarised(responses)
    middle = f"{words.quantity(responses)}: median of {counted(summary.count, 'valid response')}"
    if not summary.count:
        middle = f"{words.quantity(responses)}: no valid response"
    caption = _written(f"{middle}, {words.lines_phrase(responses)}", width, unicode)
    if width < _WIDTH_MIN or height < _HEIGHT_MIN or not summary.count:
        return caption
    picture = _picture(summary, width, height - 1, colour, unicode)
    if not unicode:
        picture = _written(picture)
    return f"{caption}\n{picture}"


def _picture(summary: Summary, width: int, height: int, colour: bool, unicode: bool) -> str:
    import plotext

    terminal = type(plotext.terminal)()
    terminal.limit(False, False)
    figure = type(plotext.figure)(parent=terminal)
    figure.plot_size(width, height)
    figure.subplots(2, 1)
    figure.theme("colorless")
    magnitude_db, phase_deg = summary.magnitude_db[1], summary.phase_deg[1]
    upper = -(-(height - 1) * 5 // 9)  # the lower panel has one more line, the label of the frequency
    rows = max((upper - 2) // 2, 2)
    ranges = [_range(magnitude_db, 1.0), _range(phase_deg, 5.0)]
    ticks_at = [ticks.linear_ticks(*ranges[0], most=rows), ticks.phase_ticks(*ranges[1], most=max(rows - 1, 2))]
    labels = [[f"{t:g}" for t in at] for at in ticks_at]
    margin = max(len(label) for panel in labels for label in panel)
    unit = words.magnitude_label(summary.responses, width - margin - 2)
    for i, (values, title, size) in enumerate(
        ((magnitude_db, unit, upper), (phase_deg, "phase in degrees", height - upper))
    ):
        panel = figure.subplot(i + 1, 1)
        panel.plot_size(width, size)
        panel.axes(False, axis=0, side=1)
        panel.title(_written(title, width, unicode))
        panel.ruler(1, 0).lim(*ranges[i]).ticks(ticks_at[i], [label.rjust(margin) for label in labels[i]])
        _frequency_ruler(panel, summary, width - margin - 2)
        _curve(panel, summary.responses.lines.frequency_hz, values, width, colour, unicode)
    figure.subplot(2, 1).label("frequency in Hz", 0, 0)
    return str(figure.build().string(not colour)).rstrip("\n")


def _frequency_ruler(panel: Any, summary: Summary, canvas: int) -> None:
    """Ticks at round frequencies; positions are logarithms, because plotext's log scale labels only powers of ten."""
    low_hz, high_hz = ticks.frequency_limits(summary.responses.lines.frequency_hz)
    at = ticks.line_ticks(summary.responses.lines.frequency_hz, low_hz, high_hz, most=max(3, min(10, canvas // 9)))
    panel.ruler(0, 0).lim(float(np.log10(low_hz)), float(np.log10(high_hz))).ticks(
        [float(np.log10(f)) for f in at], [ticks.frequency_label(f) for f in at]
    )


def _curve(panel: Any, frequency_hz: Floats, values: Floats, width: int, colour: bool, unicode: bool) -> None:
    """Draw the curve, interrupted at lines without a value, and a dot at each line if they are few."""
    from plotext import marker, pixel

    known = np.isfinite(values)
    x, y = np.log10(frequency_hz[known]).tolist(), values[known].tolist()
    trace = panel.signal(x, y, marker=marker("braille" if unicode else ".", pixel("cyan") if colour else None))
    at = np.flatnonzero(known)
    for i in range(1, len(at)):
        trace.line(i, bool(at[i] == at[i - 1] + 1))
    panel.draw(trace)
    if len(x) <= width // 4:
        panel.draw(panel.signal(x, y, marker=marker("●" if unicode else "o", pixel("orange+") if colour else None)))


def _range(values: Floats, least: float) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    margin = max(0.06 * (high - low), least)
    return low - margin, high + margin


def _written(text: str, width: int | None = None, unicode: bool = False) -> str:
    """Text in at most `width` columns; without Unicode, characters outside ASCII become question marks."""
    if not unicode:
        text = text.translate(_PLAIN).encode("ascii", "replace").decode()
    if width is not None:
        text = shortened(text, width)
    return text if unicode else text.translate(_PLAIN)
