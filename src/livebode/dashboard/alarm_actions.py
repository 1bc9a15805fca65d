"""The events that record what a person does with an alarm."""

from __future__ import annotations

from typing import Any

from livebode.core import Event
from livebode.dashboard.alarm import AlarmShelf
from livebode.dashboard.notices import ACKNOWLEDGED, SHELVED, UNSHELVED, Notice
from livebode.language import Message, Moment


def acknowledgement(
    notice: Notice, key: str, count: int, sample: int, time_s: float, by: str = "", comment: str = ""
) -> Event:
    """The event that records the acknowledgement of `count` events of a cause, of which `key` is the last."""
    details = _about(notice, key) | {"time_s": notice.last_s, "count": count}
    details |= {name: text for name, text in (("by", by), ("comment", comment)) if text}
    message = Message("acknowledged{person}: {event}", person=_person(by, comment), event=notice.words)
    if count > 1:
        message = Message("{acknowledged} ({count} events of this cause)", acknowledged=message, count=count)
    return Event(ACKNOWLEDGED, sample, time_s, message, details)


def shelving(cause: str, shelf: AlarmShelf, sample: int, time_s: float, notice: Notice | None = None) -> Event:
    """The event that records that an alarm is shelved."""
    details = _about(notice, notice.id) if notice is not None else {"cause": cause}
    message = Message(
        "shelved{person} until {until}: {event}",
        person=_person(shelf.by, shelf.reason),
        until=Moment(shelf.until_s, shelf.until_s, 0),
        event=cause if notice is None else notice.words,
    )
    return Event(SHELVED, sample, time_s, message, details | shelf.plain())


def unshelving(cause: str, sample: int, time_s: float, notice: Notice | None = None, by: str = "") -> Event:
    """The event that records the end of a shelf, by a person or at its time."""
    details = _about(notice, notice.id) if notice is not None else {"cause": cause}
    message = Message(
        "unshelved{person}: {event}",
        person=_person(by, "") or Message(" at its time"),
        event=cause if notice is None else notice.words,
    )
    return Event(UNSHELVED, sample, time_s, message, details | ({"by": by} if by else {}))


def _about(notice: Notice, key: str) -> dict[str, Any]:
    return {"event": key, "kind": notice.kind, "cause": notice.cause}


def _person(by: str, words: str) -> str:
    """Who, and their words in parentheses."""
    if not by:
        return f" ({words})" if words else ""
    return Message(" by {name} ({words})", name=by, words=words) if words else Message(" by {name}", name=by)
