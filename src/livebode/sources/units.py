"""Units written after names, and units of time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

SQUARE = re.compile(r"^(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]*)\]$")
ROUND = re.compile(r"^(?P<name>.*\S)\s+\((?P<unit>.*)\)$")

SECONDS = {
    "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "sekunden": 1.0,
    "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "usec": 1e-6, "microseconds": 1e-6,
    "ns": 1e-9, "nanoseconds": 1e-9,
    "min": 60.0, "h": 3600.0,
}  # fmt: skip
"""Length of each unit of time in seconds."""


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of a heading; the unit is empty if there is none.

    Square brackets may touch the name, round ones need a space before them; a number in brackets is an index.

    >>> split_unit("speed [rad/s]"), split_unit("i_q (A)"), split_unit("u[2]"), split_unit("Y(1)")
    (('speed', 'rad/s'), ('i_q', 'A'), ('u[2]', ''), ('Y(1)', ''))
    """
    text = text.strip()
    match = SQUARE.match(text) or ROUND.match(text)
    if match is None or re.fullmatch(r"[\d\s,:;]+", match["unit"]):
        return text, ""
    return match["name"], match["unit"].strip()


def split_units(headings: Sequence[str]) -> list[tuple[str, str]]:
    """`split_unit` for each heading; if headings differ only by their unit, it remains in the name.

    >>> split_units(["t [s]", "x [m]", "x [inch]"])
    [('t', 's'), ('x [m]', 'm'), ('x [inch]', 'inch')]
    """
    pairs = [split_unit(heading) for heading in headings]
    count = Counter(name for name, _ in pairs)
    return [(name if count[name] == 1 else text, unit) for text, (name, unit) in zip(headings, pairs, strict=True)]


def time_unit(name: str, unit: str) -> str:
    """Unit of a time column from its unit or from the end of its name (`time_us`); empty if neither gives it.

    >>> time_unit("time", "ms"), time_unit("timestamp_ns", ""), time_unit("t", ""), time_unit("t", "rad")
    ('ms', 'ns', '', 'rad')
    """
    if unit:
        return unit
    tail = name.rpartition("_")[2].casefold()
    return tail if "_" in name and tail in SECONDS else ""
