"""Gains and filters of the newest `livebode tune` of a run, from the files that it wrote."""

from __future__ import annotations

import re
from math import atan, isfinite, log10, pi, sqrt
from pathlib import Path
from typing import Any

from livebode.configuration.toml_file import parse_table
from livebode.core import LivebodeError, Model
from livebode.records.inside import read_bytes
from livebode.tuning.gains_text import gains_in

_FILTERS, _GAINS = "filters.h", "gains.toml"
_BYTES_MAX = 64 << 10
_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?"
_RATE = re.compile(rf"/\* Filters in series with the velocity controller, (?:none|({_NUMBER}) Hz)\.")
_ROW = re.compile(r"\{" + ", ".join([f"({_NUMBER})"] * 5) + r"\}")
_COUNT = re.compile(r"#define LIVEBODE_FILTERS (\d+)\b")
_SAME = 1e-9


def proposed_controller(directory: Path, controller: Model) -> dict[str, Any] | None:
    """Gains, notches and low-passes as the page sets them; None without a header of filters that livebode wrote.

    The gains are None where the run has none (earlier versions), or those of another controller than the described one.
    """
    header = _text(directory, _FILTERS)
    filters = None if header is None else _filters(header)
    if filters is None:
        return None
    gains = _gains(directory, controller)
    nothing = gains is None and not filters["notches"] and not filters["low_passes_hz"]
    return None if nothing else {"gains": gains, **filters}


def _gains(directory: Path, controller: Model) -> dict[str, float] | None:
    try:
        return gains_in(parse_table(read_bytes(directory, _GAINS, _BYTES_MAX), _GAINS), controller)
    except (OSError, LivebodeError):
        return None


def _text(directory: Path, name: str) -> str | None:
    try:
        return read_bytes(directory, name, _BYTES_MAX).decode("ascii")
    except (OSError, ValueError, LivebodeError):
        return None


def _filters(text: str) -> dict[str, Any] | None:
    """Those of the header; None where it is not livebode's."""
    head = _RATE.match(text)
    found: dict[str, Any] = {"notches": [], "low_passes_hz": []}
    if head is None or head[1] is None:
        return None if head is None else found
    rate_hz, count, rows = float(head[1]), _COUNT.search(text), _ROW.findall(text)
    if count is None or int(count[1]) != len(rows):
        return None  # damaged: gains are proposed only with all of their filters
    for row in rows:
        b0, b1, b2, a1, a2 = map(float, row)
        tangent, damping = _pole(a1, a2)
        frequency_hz = atan(tangent) * rate_hz / pi
        if not (isfinite(frequency_hz) and frequency_hz > 0):
            return None
        if abs(b1 - 2 * b0) < _SAME * abs(b0) and abs(b2 - b0) < _SAME * abs(b0):
            found["low_passes_hz"].append(frequency_hz)
            continue
        # The numerator is that of a pole with damping·depth, times its own scale.
        scale = (b0 + b2) * (1 + tangent**2 + 2 * damping * tangent) / (2 * (1 + tangent**2))
        if abs(scale - 1) > _SAME or b0 <= b2:
            return None  # not a notch: of another program
        share = (b0 - b2) / (1 - a2)
        found["notches"].append({"hz": frequency_hz, "depth_db": -20 * log10(share), "damping": damping})
    return found


def _pole(a1: float, a2: float) -> tuple[float, float]:
    """tan(π·frequency/rate) and damping of the denominator 1 + a1/z + a2/z², by the bilinear transformation."""
    both = 1 + a2
    if not (abs(a1) < both and a2 < 1):
        return float("nan"), float("nan")  # not a stable filter of second order
    tangent = sqrt((both + a1) / (both - a1))
    return tangent, (1 - a2) / both * (1 + tangent**2) / (2 * tangent)
