"""Units written after names, and units of time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from livebode.core import read_unit

BRACKETED = re.compile(r"\[.*\]|\(.*\)")
IN_UNIT = re.compile(r"(?:(?P<name>.*\S)\s+)?in (?P<unit>\S+)")
"""A heading of Rohde & Schwarz: "in s", "C1 in V"."""
OPENING = {"]": "[", ")": "("}

UNIT_IN_FRONT = re.compile(r"(?P<unit>[mun]?s)_(?:today|time|timestamp)", re.IGNORECASE)
"""A time with its unit in front, such as ms_today in the logs of VESC Tool."""
SECONDS = {
    "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "sekunden": 1.0,
    "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "usec": 1e-6, "microseconds": 1e-6,
    "ns": 1e-9, "nanoseconds": 1e-9,
    "min": 60.0, "h": 3600.0, "秒": 1.0, "毫秒": 1e-3, "微秒": 1e-6,
}  # fmt: skip
"""Length of each unit of time in seconds."""


RELATIVE = frozenset(
    ("%", "‰", "v", "mv", "counts", "count", "cts", "inc", "incr", "inkr", "inkremente", "lsb", "脉冲")
)
"""Units without an SI value of their own; without capitals."""


def is_unit(text: str) -> bool:
    """Whether it is a usual unit: of time, of the kinds of quantities, or relative to something.

    >>> is_unit("mV"), is_unit("rad/s"), is_unit("sec"), is_unit("%"), is_unit("k"), is_unit("")
    (True, True, True, True, False, False)
    """
    return text.casefold() in SECONDS or text.casefold() in RELATIVE or read_unit(text).kind != "other"


def split_unit(text: str) -> tuple[str, str]:
    """Name and unit of a heading; the unit is empty if there is none.

    Square brackets may touch the name, round ones need a space before them or a usual unit in them; a number in
    brackets is an index. A unit may contain brackets itself.

    >>> split_unit("speed [rad/s]"), split_unit("i_q (A)"), split_unit("u[2]"), split_unit("Y(1)")
    (('speed', 'rad/s'), ('i_q', 'A'), ('u[2]', ''), ('Y(1)', ''))
    >>> split_unit("a [m/(s^2)]"), split_unit("x (N (rms))")
    (('a', 'm/(s^2)'), ('x', 'N (rms)'))
    >>> split_unit("Time(s)"), split_unit("C1 in V"), split_unit("in s"), split_unit("f(s)")
    (('Time', 's'), ('C1', 'V'), ('time', 's'), ('f(s)', ''))
    """
    text = text.strip()
    if (written := IN_UNIT.fullmatch(text)) and is_unit(written["unit"]):
        return written["name"] or "time", written["unit"]
    at = last_bracket(text)
    name, unit = text[:at].rstrip(), text[at + 1 : -1].strip()
    touches = len(name) == at and not (len(name) > 1 and is_unit(unit))
    if not name or (text[-1] == ")" and touches) or re.fullmatch(r"[\d\s,:;]+", unit):
        return text, ""
    return name, unit


def last_bracket(text: str) -> int:
    """Where the bracket opens that closes at the end of `text`; 0 without one.

    >>> last_bracket("x (N (rms))"), last_bracket("x)")
    (2, 0)
    """
    closing = text[-1:]
    opening, depth = OPENING.get(closing), 0
    for at in range(len(text) - 1, -1, -1):
        depth += (text[at] == closing) - (text[at] == opening)
        if depth == 0:
            return at if opening else 0
    return 0


def unbracketed(unit: str) -> str:
    """A unit without the brackets or dashes around it.

    >>> unbracketed("[m/(s^2)]"), unbracketed("(N (rms))"), unbracketed("-"), unbracketed("V")
    ('m/(s^2)', 'N (rms)', '', 'V')
    """
    whole = unit[-1:] in OPENING and last_bracket(unit) == 0 and unit[0] == OPENING[unit[-1]]
    return (unit[1:-1] if whole else unit).strip(" -")


def split_units(headings: Sequence[str]) -> list[tuple[str, str]]:
    """`split_unit` for each heading; if headings differ only by their unit, it remains in the name.

    Units behind a stroke (DIN 1313) or a comma are units if those of all such headings are.

    >>> split_units(["t [s]", "x [m]", "x [inch]"])
    [('t', 's'), ('x [m]', 'm'), ('x [inch]', 'inch')]
    >>> split_units(["t/s", "n / min-1", "on"]), split_units(["t, ms", "M, N·m"]), split_units(["x/A", "x/status"])
    ([('t', 's'), ('n', 'min-1'), ('on', '')], [('t', 'ms'), ('M', 'N·m')], [('x/A', ''), ('x/status', '')])
    """
    pairs = _with_mark(headings, "/") or _with_mark(headings, ",") or [split_unit(heading) for heading in headings]
    count = Counter(name for name, _ in pairs)
    return [(name if count[name] == 1 else text, unit) for text, (name, unit) in zip(headings, pairs, strict=True)]


def _with_mark(headings: Sequence[str], mark: str) -> list[tuple[str, str]]:
    """Names and units of headings, several of which have a unit behind this mark; none if another has no unit there."""
    pairs = [(name.strip(), unit.strip()) for name, _, unit in (heading.partition(mark) for heading in headings)]
    marked = [unit for (_, unit), heading in zip(pairs, headings) if mark in heading]
    return pairs if len(marked) > 1 and all(map(is_unit, marked)) else []


def time_unit(name: str, unit: str) -> str:
    """Unit of a time column from its unit or its name (`time_us`, `ms_today`); empty if neither gives it.

    >>> time_unit("time", "ms"), time_unit("timestamp_ns", ""), time_unit("t", ""), time_unit("t", "rad")
    ('ms', 'ns', '', 'rad')
    """
    if unit:
        return unit
    if in_front := UNIT_IN_FRONT.fullmatch(name):
        return in_front["unit"].casefold()
    tail = name.rpartition("_")[2].casefold()
    return tail if "_" in name and tail in SECONDS else ""
