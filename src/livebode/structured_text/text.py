"""Pieces of Structured Text: numbers, comments, declarations."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite

from livebode.core import UsageError, counted

BYTES_MAX = 8 << 20
"""Most memory of one block or ring: limit of what livebode reads from a PLC, and more than most PLCs have free."""


Declared = tuple[str, str, str]
"""A variable, or several with commas between: name, type with its initial value, comment."""


def real(value: float) -> str:
    """The number as an LREAL literal, whose digits give the same bits.

    >>> real(0.1), real(1e-17), real(-3)
    ('0.1', '1.0E-17', '-3.0')
    """
    digits, _, exponent = repr(float(value)).partition("e")
    return (digits if "." in digits else f"{digits}.0") + (f"E{int(exponent)}" if exponent else "")


def comment(text: str) -> str:
    """Comment lines (`//`) in ASCII, because not every programming system accepts other letters; empty for no text."""
    lines = text.encode("ascii", "replace").decode().splitlines()
    return "".join(f"// {''.join(c if c.isprintable() else ' ' for c in line)}".rstrip() + "\n" for line in lines)


def section(kind: str, declared: Iterable[Declared]) -> str:
    """Declarations from `VAR_…` to `END_VAR`, aligned."""
    rows = list(declared)
    width = min(max(len(name) for name, _, _ in rows), 14)
    types = max(len(of) for _, of, _ in rows) + 1
    lines = [f"    {name:<{width}} : {f'{of};':<{types}}  // {comment}".rstrip(" /") for name, of, comment in rows]
    return "\n".join([kind, *lines, "END_VAR", ""])


def array(*lengths: int, of: str = "LREAL") -> str:
    """The type of an array that counts from 0.

    >>> array(2, 7)
    'ARRAY [0..1, 0..6] OF LREAL'
    """
    return f"ARRAY [{', '.join(f'0..{length - 1}' for length in lengths)}] OF {of}"


def check_rate(rate_hz: float) -> None:
    """UsageError for an invalid rate of a task."""
    if not (isfinite(rate_hz) and rate_hz > 0):
        raise UsageError(
            "out-of-range",
            f"{rate_hz=} is not above 0",
            "give the cycles of the task per second",
            argument="rate_hz",
            value=rate_hz,
        )


def check_bytes(fixed: int, each: int, count: int, what: str) -> None:
    """UsageError if `fixed` + `each`·`count` bytes are more than a PLC has; `what` describes the counted object."""
    needed = fixed + each * count
    if needed > BYTES_MAX:
        most = (BYTES_MAX - fixed) // each
        raise UsageError(
            "too-large",
            f"{what} of {counted(count, 'sample')} takes {needed} bytes of the PLC, more than {BYTES_MAX}",
            f"use at most {counted(most, 'sample')}",
            samples=count,
            samples_max=most,
            size_bytes=needed,
            limit_bytes=BYTES_MAX,
        )
