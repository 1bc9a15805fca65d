"""Numbers, times and settings as a report shows them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, log10
from typing import Any

import numpy as np
import tomli_w

from livebode.core import PrintedTable, Response
from livebode.language import number, tr, trn

_LINES_SHOWN = 120


def lines_of(number: int) -> str:
    """
    >>> lines_of(1), lines_of(1234)
    ('1 line', '1,234 lines')
    """
    return trn("{n:,} line", "{n:,} lines", number)


def share(part: float, whole: float) -> str:
    """
    >>> share(1, 300), share(0, 3)
    ('0.33 %', '0 %')
    """
    percent = 100 * part / whole if whole else 0.0
    return f"{number(percent, '.2g' if percent < 10 else '.0f')} %"


def duration(of_s: float) -> str:
    """
    >>> duration(22.6), duration(7325)
    ('22.6 s', '2 h 2 min 5 s')
    """
    if of_s < 120:
        return f"{number(of_s, '.3g')} s"
    minutes, seconds = divmod(round(of_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min {seconds} s" if hours else f"{minutes} min {seconds} s"


def decibels(size: float) -> float:
    """20·log10; −inf for zero."""
    return 20 * log10(size) if size > 0 else -float("inf")


def polar(value: complex, radius: float) -> tuple[str, str, str, str]:
    """Magnitude in dB with its bound and phase in degrees with its bound, for a value with a circular bound.

    The bound in dB is the larger side, towards zero. A circle that contains zero gives no bounds.
    """
    size = abs(value)
    if not isfinite(size) or size == 0:
        return "—", "—", "—", "—"
    db, deg = number(decibels(size), ".2f"), number(np.degrees(np.angle(value)), ".2f")
    if not isfinite(radius):
        return db, tr("not known"), deg, tr("not known")
    if radius >= size:
        return db, tr("unbounded"), deg, tr("unbounded")
    half_db, half_deg = -decibels(1 - radius / size), np.degrees(np.arcsin(radius / size))
    return db, number(half_db, ".2g"), deg, number(half_deg, ".2g")


def polar_phrase(value: complex, radius: float) -> str:
    """A ratio in dB and degrees with its circular bound, for a sentence.

    >>> polar_phrase(2, 0.2), polar_phrase(2, 3), polar_phrase(2, np.inf)
    ('+6.02 ± 0.92 dB, +0.00 ± 5.7°', 'at most +13.98 dB, phase not known', '+6.02 dB, +0.00°, bound not known')
    """
    db, around, deg, turned = polar(value, radius)
    if isfinite(radius) and radius >= abs(value) > 0:
        return tr("at most {db} dB, phase not known", db=signed(number(decibels(abs(value) + radius), ".2f")))
    if not isfinite(radius):
        return tr("{db} dB, {deg}°, bound not known", db=signed(db), deg=signed(deg))
    return tr(
        "{db} ± {around} dB, {deg} ± {turned}°", db=signed(db), around=around, deg=signed(deg), turned=turned
    )  # fmt: skip


def signed(number: str) -> str:
    """
    >>> signed("0.5"), signed("-0.5"), signed("—")
    ('+0.5', '-0.5', '—')
    """
    return number if number.startswith(("-", "—")) else f"+{number}"


def polar_rows(response: Response) -> list[tuple[str, str, str, str]]:
    """`polar` of each line with its bound."""
    return [polar(complex(v), float(r)) for v, r in zip(response.value, response.bound())]


def pairs(rows: list[tuple[str, str]]) -> PrintedTable:
    """A table of names and values, without empty values."""
    return PrintedTable(("", ""), tuple((name, value) for name, value in rows if value))


def line_table(headings: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> PrintedTable:
    """A table of numbers with a row for each line; of many lines it shows every n-th, and says so."""
    step = -(-len(rows) // _LINES_SHOWN)
    note = tr(
        "{shown} of {count} lines are shown; the picture and the record contain all.",
        shown=len(rows[::step]), count=len(rows),
    )  # fmt: skip
    return PrintedTable(headings, tuple(rows[::step]), tuple(range(len(headings))), note if step > 1 else "")


def to_toml(values: dict[str, Any]) -> str:
    """Plain data as TOML, without values that are None.

    >>> print(to_toml({"lines": {"window": 400, "frequencies": "20:140:20"}, "fit": None}))
    [lines]
    window = 400
    frequencies = "20:140:20"
    """
    return tomli_w.dumps(_specified(values)).strip("\n")


def _specified(value: Any) -> Any:
    """The value without None, which TOML does not have."""
    if isinstance(value, dict):
        return {name: _specified(inner) for name, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_specified(item) for item in value if item is not None]
    return value
