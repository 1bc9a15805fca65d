"""Texts of the pictures: the quantity, its unit, how much is valid."""

from __future__ import annotations

import numpy as np

from livebode.core import Responses, counted
from livebode.core.clock import moment, moment_of_start
from livebode.drawing.ticks import frequency_label
from livebode.report.style import shortened

_SYMBOL = {"plant": "G", "open loop": "L", "closed loop": "T", "sensitivity": "S"}
_CLOCK_FROM_S = 1e5


def quantity(responses: Responses) -> str:
    """The quantity with its usual letter: "plant G"."""
    letter = _SYMBOL.get(responses.quantity)
    return f"{responses.quantity} {letter}" if letter else str(responses.quantity)


def magnitude_label(responses: Responses, letters: int = 60) -> str:
    """The label of the magnitude, with the unit of 0 dB."""
    return shortened(f"magnitude in dB re 1 {responses.unit}" if responses.unit else "magnitude in dB", letters)


def lines_phrase(responses: Responses) -> str:
    """Number of lines and their range."""
    f = responses.lines.frequency_hz
    if len(f) == 1:
        return f"1 line, {frequency_label(f[0])} Hz"
    return f"{len(f)} lines, {frequency_label(f[0])}–{frequency_label(f[-1])} Hz"


def facts(responses: Responses, valid_rows: int, names: tuple[str, str] | None = None) -> str:
    """The line below the title: quantity, channels, lines, and how much is valid."""
    path = f" from {shortened(names[0], 30)} to {shortened(names[1], 30)}" if names else ""
    return f"{quantity(responses)}{path} · {lines_phrase(responses)} · {valid_rows} of {counted(len(responses))} valid"


def clock(time_s: np.ndarray) -> tuple[float, str]:
    """Origin to subtract from times, with the label: seconds since 1970 are unreadable as ticks."""
    finite = time_s[np.isfinite(time_s)]
    first, last = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    if abs(first) < _CLOCK_FROM_S or last - first > abs(first) / 10:
        start = moment_of_start()
        return 0.0, f"time in s after {start}" if start else "time in s"
    origin = float(np.floor(first))
    return origin, f"time in s after {moment(origin, 0)}"
