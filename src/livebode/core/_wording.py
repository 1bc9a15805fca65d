"""Counts, numbers and remedies in sentences."""

from math import floor, isfinite, log10

from livebode.language import number, tr


def counted(count: int, noun: str = "response") -> str:
    """
    >>> counted(1), counted(3)
    ('1 response', '3 responses')
    """
    return f"{count} {plural(noun, count)}"


def plural(noun: str, count: int) -> str:
    """
    >>> plural("option", 1), plural("option", 2)
    ('option', 'options')
    """
    return noun if count == 1 else f"{noun}s"


def rounded_down(value: float) -> float:
    """The value, above 0, rounded down to four digits: a remedy that is followed literally must pass.

    >>> rounded_down(1.23456), rounded_down(0.0019996)
    (1.234, 0.001999)
    """
    near = float(f"{value:.4g}")
    return near if near <= value else float(f"{value * (1 - 5e-4):.4g}")


_PLACES_MAX = 6


def with_bound(value: float, bound: float) -> tuple[str, str]:
    """Value and bound, rounded to two significant digits of the bound.

    >>> with_bound(501234.5, 1234.5), with_bound(0.0028, 1.2e-5), with_bound(3.0, float("nan"))
    (('501200', '1200'), ('0.002800', '0.000012'), ('3', 'not known'))
    >>> with_bound(-1e-9, 2e-4), with_bound(2e-14, 1.6e-7)
    (('0.00000', '0.00020'), ('0', '1.6e-07'))
    >>> with_bound(-4.16, 250.0)
    ('0', '250')
    """
    if not isfinite(value):
        return "—", "—"
    if not isfinite(bound) or bound <= 0:
        return number(value, ".5g"), tr("fixed") if bound == 0 else tr("not known")
    digits = 1 - floor(log10(bound))
    if abs(value) >= 1e7 or digits > 9:
        return number(value, ".5g"), number(bound, ".2g")
    places = f".{max(digits, 0)}f"
    # A row of zeros is not legible.
    half = number(bound, ".2g") if digits > _PLACES_MAX else number(round(bound, digits), places)
    shown = round(value, digits) + 0.0  # no minus sign before a zero
    return "0" if shown == 0 and digits > _PLACES_MAX else number(shown, places), half
