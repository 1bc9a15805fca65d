"""Counts and remedies in sentences."""


def counted(count: int, what: str = "response") -> str:
    """
    >>> counted(1), counted(3)
    ('1 response', '3 responses')
    """
    return f"{count} {plural(what, count)}"


def plural(what: str, count: int) -> str:
    """
    >>> plural("option", 1), plural("option", 2)
    ('option', 'options')
    """
    return what if count == 1 else f"{what}s"


def rounded_down(value: float) -> float:
    """The value, above 0, rounded down to four digits: a remedy that is followed literally must pass.

    >>> rounded_down(1.23456), rounded_down(0.0019996)
    (1.234, 0.001999)
    """
    near = float(f"{value:.4g}")
    return near if near <= value else float(f"{value * (1 - 5e-4):.4g}")
