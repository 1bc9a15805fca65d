"""Times of day in recorded sentences, so that the page can show them by another clock."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import datetime
from typing import Any

_DATE = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) ([A-Z]{2,6}|[+-]\d\d(?:\d\d)?)\b")


def times_in(message: str) -> list[tuple[str, float]]:
    """Each time of day in a sentence, as it is written, with its seconds since 1970.

    A sentence has its times in the zone of the process that wrote it. A time with an abbreviation that this process's
    zone does not have then is left out.
    """
    found = ((match[0], _unix_s(match[1], match[2])) for match in _DATE.finditer(message))
    return [(text, unix_s) for text, unix_s in found if unix_s is not None]


def with_times(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows with a message, each with the times in it."""
    return [row | {"times": times_in(row["message"])} for row in rows]


def _unix_s(text: str, zone: str) -> float | None:
    try:
        local = datetime.fromisoformat(text)
        for fold in (0, 1):  # the hour that is passed twice
            moment = local.replace(fold=fold).astimezone()
            if moment.tzname() == zone:
                return moment.timestamp()
    except (ValueError, OverflowError, OSError):
        return None
    return None
