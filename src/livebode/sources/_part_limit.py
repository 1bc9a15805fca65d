"""Where a part of a recording begins or ends, as a person writes it: seconds, samples or periods."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from livebode.core import UsageError

LimitUnit = Literal["s", "samples", "periods"]

PATTERN = r"^ *([+-]?[0-9]{1,15}([.][0-9]{0,15})? *s?|[0-9]{1,15} *samples?|[0-9]{1,9}([.][0-9]{0,9})? *periods?) *$"
"""Of a text; also for editors, in JSON Schema."""


@dataclass(frozen=True)
class PartLimit:
    """A moment in a recording.

    Attributes
    ----------
    value
        Seconds in the time of the recording, number of a sample, or number of periods of the excitation.
    unit
        Which of these.
    """

    value: float
    unit: LimitUnit

    def sample(self, rate_hz: float, origin_s: float) -> int:
        """Number of the first sample at or after a moment in seconds or samples; at least 0."""
        if self.unit == "samples":
            return int(self.value)
        # A time that is written with few digits means the sample that it rounds to.
        return max(0, math.ceil((self.value - origin_s) * rate_hz - 1e-3))


def part_limit(given: float | str) -> PartLimit:
    """The moment that a number (seconds) or a text means.

    >>> part_limit(2.5), part_limit("5000 samples").unit, part_limit("3 periods").value
    (PartLimit(value=2.5, unit='s'), 'samples', 3.0)

    Raises
    ------
    UsageError
        If the text is neither.
    """
    if not isinstance(given, str):
        return PartLimit(given, "s")
    if re.fullmatch(PATTERN, given) is None:
        shown = repr(given) if len(given) < 80 else "the limit"
        raise UsageError(
            "unreadable",
            f"{shown} is neither seconds, a whole number of samples, nor periods",
            "write for example 2.5 (seconds), '5000 samples' or '3 periods'",
            value=shown,
        )
    number = given.strip().rstrip("adelmopris ")
    return PartLimit(float(number), "samples" if "a" in given else "periods" if "p" in given else "s")
