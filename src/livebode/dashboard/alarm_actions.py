"""The events that record what a person does with an alarm."""

from __future__ import annotations

from typing import Any

from livebode.core import Event
from livebode.core.clock import date_and_time
from livebode.dashboard.alarm import AlarmShelf
from livebode.dashboard.notices import ACKNOWLEDGED, SHELVED, UNSHELVED, Notice


def acknowledgement(
    notice: Notice, key: str, count: int, sample: int, time_s: float, by: str = "", comment: str = ""
) -> Event:
    """The event that records the acknowledgement of `count` events of a cause, of which `key` is the last."""
    details = _about(notice, key) | {"time_s": notice.last_s, "count": count}
    details |= {name: text for name, text in (("by", by), ("comment", comment)) if text}
    often = f" ({count} events of this cause)" if count > 1 else ""
    return Event(ACKNOWLEDGED, sample, time_s, f"acknowledged{_person(by, comment)}: {notice.message}{often}", details)


def shelving(cause: str, shelf: AlarmShelf, sample: int, time_s: float, notice: Notice | None = None) -> Event:
    """The event that records that an alarm is shelved."""
    details = _about(notice, notice.id) if notice is not None else {"cause": cause}
    until = f" until {date_and_time(shelf.until_s)}"
    message = f"shelved{_person(shelf.by, shelf.reason)}{until}: {cause if notice is None else notice.message}"
    return Event(SHELVED, sample, time_s, message, details | shelf.plain())


def unshelving(cause: str, sample: int, time_s: float, notice: Notice | None = None, by: str = "") -> Event:
    """The event that records the end of a shelf, by a person or at its time."""
    details = _about(notice, notice.id) if notice is not None else {"cause": cause}
    message = f"unshelved{_person(by, '') or ' at its time'}: {cause if notice is None else notice.message}"
    return Event(UNSHELVED, sample, time_s, message, details | ({"by": by} if by else {}))


def _about(notice: Notice, key: str) -> dict[str, Any]:
    return {"event": key, "kind": notice.kind, "cause": notice.cause}


def _person(by: str, words: str) -> str:
    """Who, and their words in parentheses."""
    return (f" by {by}" if by else "") + (f" ({words})" if words else "")
