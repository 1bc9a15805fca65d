"""The filters of the newest `livebode tune` of a run, from the C header that it wrote."""

from __future__ import annotations

import re
from math import atan, isfinite, log10, pi, sqrt
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError
from livebode.records.inside import read_bytes

_NAME = "filters.h"
_BYTES_MAX = 64 << 10
_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?"
_RATE = re.compile(rf"/\* Filters in series with the velocity controller, ({_NUMBER}) Hz\.")
_ROW = re.compile(r"\{" + ", ".join([f"({_NUMBER})"] * 5) + r"\}")
_SAME = 1e-9


def proposed_filters(directory: Path) -> dict[str, Any] | None:
    """Notches and low-passes of the header as the page sets them; None without a header that livebode wrote."""
    try:
        text = read_bytes(directory, _NAME, _BYTES_MAX).decode("ascii")
    except (OSError, ValueError, LivebodeError):
        return None
    rate = _RATE.match(text)
    if rate is None or not float(rate[1]) > 0:
        return None
    found: dict[str, Any] = {"rate_hz": float(rate[1]), "notches": [], "low_passes_hz": []}
    for row in _ROW.findall(text):
        b0, b1, b2, a1, a2 = map(float, row)
        tangent, damping = _pole(a1, a2)
        frequency_hz = atan(tangent) * found["rate_hz"] / pi
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
