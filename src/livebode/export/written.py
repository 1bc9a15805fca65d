"""What an export came to, and the limit on what is held at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from livebode.core import InputError, Responses

VALUES_MAX = 1 << 23
"""Most values (responses times lines) that a format takes which is not written in parts: some 2 GB of memory."""


class Written(NamedTuple):
    """How many rows stand in a file, and how many the format could not take."""

    rows: int
    left_out: int = 0


def whole(parts: Iterable[Responses], format: str) -> Responses:
    """All parts as one, while they are few enough.

    Raises
    ------
    InputError
        If there are none, or they have more than `VALUES_MAX` values.
    """
    kept, values = [], 0
    for part in parts:
        values += part.value.size
        if values > VALUES_MAX:
            raise InputError(
                f"the run has more than {VALUES_MAX} values (responses times lines), too many to write as {format} "
                "at once; export one response (--at TIME), their mean (--mean), or csv, which is written in parts"
            )
        kept.append(part)
    if not values:
        raise InputError("the run has no responses to export")
    return Responses.join(kept)
