"""Result of an export, and the limit of what is in memory at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, TypeVar

from livebode.core import MatrixResponses, OutputError, RecordError, Responses

Rows = TypeVar("Rows", Responses, MatrixResponses)

VALUES_MAX = 1 << 23
"""Most values (responses times lines, times entries of a matrix) of a format that is not written in parts: about 2 GB
of memory."""


class WriteResult(NamedTuple):
    """Number of rows in a file, and of rows that the format could not represent."""

    rows: int
    left_out: int = 0


def whole(parts: Iterable[Rows], format: str) -> Rows:
    """All parts as one, if their size is allowed.

    Raises
    ------
    RecordError
        If there are none.
    OutputError
        If they have more than `VALUES_MAX` values.
    """
    kept: list[Rows] = []
    values = 0
    for part in parts:
        values += part.value.size
        if values > VALUES_MAX:
            raise OutputError(
                "too-large",
                f"the run has more than {VALUES_MAX} values (responses times lines), too many to write as {format}",
                "export one response, their mean, or csv, which is written in parts",
                format=format,
                limit=VALUES_MAX,
            )
        kept.append(part)
    if not values:
        raise RecordError("no-responses", "the run has no responses to export", "see its events")
    return type(kept[0]).join(kept)
