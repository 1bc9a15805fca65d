"""What a person may ask for an alarm (acknowledge, shelve, unshelve), validated, and the events that record it."""

from __future__ import annotations

from typing import Any, Literal

from livebode.core import Event, ServerError, UsageError
from livebode.dashboard.alarm import AlarmShelf
from livebode.dashboard.notices import ACKNOWLEDGED, SHELVED, UNSHELVED, Notice
from livebode.dashboard.queries import check_letters, json_object, whole_number
from livebode.dataclass import dataclass
from livebode.language import Message, Moment

Act = Literal["acknowledge", "shelve", "unshelve"]
NAME_MAX, TEXT_MAX = 60, 200
"""Most letters of a name, and of a comment or reason."""
MINUTES_MAX = 24 * 60


@dataclass(frozen=True)
class AlarmRequest:
    """An action on the alarm of an event: who, their comment or reason, and for how many minutes."""

    axis: int
    event: str
    by: str = ""
    words: str = ""
    minutes: float = 0.0


def alarm_request(data: bytes, axes: int, act: Act) -> AlarmRequest:
    """Parse the body of a request; LivebodeError if it is invalid.

    >>> alarm_request(b'{"axis": 0, "event": "3f", "by": "Ann", "reason": "test", "minutes": 30}', 1, "shelve").minutes
    30.0
    """
    message = json_object(data)
    axis, event = message.get("axis"), message.get("event")
    if isinstance(axis, bool) or not isinstance(axis, int) or not isinstance(event, str) or len(event) > 64:
        raise ServerError("request-malformed", "the request does not have an axis and an event", "send both")
    by = _text(message, "by", NAME_MAX, required=act != "acknowledge")
    words = _text(message, "reason" if act == "shelve" else "comment", TEXT_MAX, required=act == "shelve")
    minutes = _minutes(message.get("minutes")) if act == "shelve" else 0.0
    return AlarmRequest(whole_number(str(axis)[:10], 0, axes - 1, "axis"), event, by, words, minutes)


def _text(message: dict[str, Any], name: str, letters_max: int, *, required: bool) -> str:
    value = message.get(name, "")
    text = " ".join(value.split()) if isinstance(value, str) else None
    if text is None or len(text) > letters_max or (required and not text):
        least = 1 if required else 0
        raise UsageError(
            "out-of-range",
            Message("{name} is not a text of {least} to {most} letters", name=name, least=least, most=letters_max),
            Message("shorten it, or add it"),
            argument=name,
            high=letters_max,
        )
    check_letters(text, name)
    return text


def _minutes(value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool) and 1 <= value <= MINUTES_MAX:
        return float(value)
    raise UsageError(
        "out-of-range",
        Message("minutes is not a number from 1 to {most}", most=MINUTES_MAX),
        Message("shelve the alarm for at most a day, and again if necessary"),
        argument="minutes",
        low=1,
        high=MINUTES_MAX,
    )


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
