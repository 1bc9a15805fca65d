"""What an oscilloscope or a recorder states above its table: the sample interval, and names by key."""

from __future__ import annotations

import re
from collections.abc import Sequence

from livebode.sources.units import SECONDS

_NUMBER = r"(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
_INTERVAL = re.compile(
    rf"\b(?:sampl\w*[ _](?:interval|period)|tinc|hresolution|delta[ _]?t)\b[^\w\n+.-]*(?:\w+:)?[^\w\n+.-]*{_NUMBER}"
    r"[^\w\n]{0,3}(?P<unit>[mµun]?s(?:ec)?\b)?",
    re.IGNORECASE,
)
_RATE = re.compile(
    rf"\bsampl\w*[ _]?(?:rate|frequency|freq)\b[^\w\n+.-]*-? ?(?:\w+:)?{_NUMBER}[^\w\n]{{0,2}}(?P<unit>[kMG]?)",
    re.IGNORECASE,
)
_PREFIX = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_NAMES = re.compile(r"(?:trace|channel|signal)[ _]?names?|names?|labels?", re.IGNORECASE)
_UNITS = re.compile(r"(?:v|y|vertical[ _]?)?units?", re.IGNORECASE)


def stated_period_s(above: str) -> float | None:
    """Seconds from sample to sample, as the lines above a table say.

    >>> stated_period_s("Sample Interval,CH1:2.0E-03"), stated_period_s("Sampling Frequency - 1000")
    (0.002, 0.001)
    >>> stated_period_s("CH1(V),t0 = -5e-01, tInc = 1.0e-03,"), stated_period_s("Sample,of,nothing")
    (0.001, None)
    """
    if found := _INTERVAL.search(above):
        period_s = float(found["value"]) * SECONDS.get((found["unit"] or "s").casefold(), 1.0)
        return period_s if period_s > 0 else None
    if found := _RATE.search(above):
        rate_hz = float(found["value"]) * _PREFIX.get(found["unit"], 1.0)
        return 1 / rate_hz if rate_hz > 0 else None
    return None


def keyed_header(above: Sequence[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of a table whose first column has only the keys of the lines above it; empty without names.

    >>> keyed_header([["TraceName", "Force", "Accel"], ["VUnit", "N", "g"]], 3)
    (['', 'Force', 'Accel'], ['', 'N', 'g'])
    """
    rows = [cells for cells in above if len(cells) == width]
    found = [next((["", *cells[1:]] for cells in rows if key.fullmatch(cells[0])), []) for key in (_NAMES, _UNITS)]
    return (found[0], found[1]) if found[0] else ([], [])
