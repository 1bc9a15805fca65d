"""Checks of single settings, each with its message."""

from __future__ import annotations

from math import isfinite
from typing import Annotated

from annotated_types import Ge, Gt

from livebode.core import UsageError

Positive = Annotated[float, Gt(0)]
NonNegative = Annotated[float, Ge(0)]
"""Limits for the schema of a file; `positive` and `nonnegative` check them."""


def positive(owner: object, *names: str) -> None:
    """Raise UsageError if one of these attributes is not finite and above 0."""
    for name in names:
        value = getattr(owner, name)
        if not (isfinite(value) and value > 0):
            raise UsageError(
                "out-of-range",
                f"{name}={value} is not a finite number above 0",
                "choose a number above 0",
                argument=name,
                value=value,
            )


def nonnegative(owner: object, *names: str) -> None:
    """Raise UsageError if one of these attributes is not finite or below 0."""
    for name in names:
        value = getattr(owner, name)
        if not (isfinite(value) and value >= 0):
            raise UsageError(
                "out-of-range",
                f"{name}={value} is not a finite number of at least 0",
                "choose 0 or a number above it",
                argument=name,
                value=value,
            )


def count(owner: object, name: str, most: int) -> None:
    """Raise UsageError if the attribute is not a whole number from 0 to `most`."""
    value = getattr(owner, name)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise UsageError(
            "out-of-range",
            f"{name}={value} is not a whole number from 0 to {most}",
            f"choose a whole number from 0 to {most}",
            argument=name,
            value=value,
            low=0,
            high=most,
        )
