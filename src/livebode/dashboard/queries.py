"""Requests of a browser: queries and web-socket messages, validated to plain values."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Mapping
from typing import Any, cast, get_args

from livebode.core import Quantity, ServerError, UsageError
from livebode.dashboard.frames import REFERENCES_MAX
from livebode.dashboard.quantities import QUANTITIES
from livebode.dashboard.signal_answer import Picture
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import TEXT_MAX

MESSAGE_BYTES_MAX = 1024
_FORMATS = ("csv", "mat")
_KINDS = ("watch", "pause", "resume", "freeze", "unfreeze")
_TURNING = {*map(chr, range(0x202A, 0x202F)), *map(chr, range(0x2066, 0x206A))}  # the direction of the text
_TIME_S_MAX = 1e12
_ID_MAX = 64


@dataclass(frozen=True)
class Span:
    """A query for the past: axis, quantity, span of time, largest number of rows, and the format of a download."""

    axis: int
    quantity: Quantity
    from_s: float
    to_s: float
    rows: int = 1200
    format: str = "csv"


@dataclass(frozen=True)
class ClientMessage:
    """A message on the web socket.

    `watch` selects axis and quantity (default: the quantity of the run), `pause` stops and `resume` continues updates,
    `freeze` makes the newest response, the one at `time_s`, or the one that was `saved` with the run under this id, the
    reference of a slot (1 to 8), `unfreeze` removes that of a slot, or all.
    """

    kind: str
    axis: int = 0
    quantity: Quantity | None = None
    time_s: float | None = None
    slot: int | None = None
    saved: str | None = None


@dataclass(frozen=True)
class SignalsRequest:
    """A query for raw signals: axis, picture, and the time in the record; None for the newest ones."""

    axis: int
    picture: Picture
    at_s: float | None


@dataclass(frozen=True)
class SavedChange:
    """A change of what is saved with a run: a reference at a time, an annotation at a frequency, or a removal by id."""

    axis: int
    kind: str
    text: str = ""
    value: float = 0.0


def span(query: Mapping[str, str], axes: int) -> Span:
    """Parse the query of a request; LivebodeError if it is invalid.

    >>> span({"axis": "0", "quantity": "plant", "from": "0", "to": "2.5"}, axes=1).to_s
    2.5
    """
    from_s, to_s = _time(query.get("from", "0")), _time(query.get("to", "0"))
    if to_s < from_s:
        raise UsageError(
            "out-of-range",
            f"from={from_s:g} is after to={to_s:g}",
            "swap them",
            argument="from",
            from_s=from_s,
            to_s=to_s,
        )
    format = query.get("format", "csv")
    if format not in _FORMATS:
        raise UsageError(
            "not-one-of",
            f"format={format[:20]!r} is not one of csv, mat",
            "choose one of them",
            argument="format",
            value=format[:20],
            allowed=list(_FORMATS),
        )
    rows = whole_number(query.get("rows", "1200"), 1, 1 << 20, "rows")
    axis = whole_number(query.get("axis", "0"), 0, axes - 1, "axis")
    return Span(axis, _quantity(query.get("quantity", "plant")), from_s, to_s, rows, format)


def moment(query: Mapping[str, str]) -> float | None:
    """The time of a query for one moment; None for the newest.

    >>> moment({"at": "2.5"}), moment({})
    (2.5, None)
    """
    return _time(query["at"]) if "at" in query else None


def signals_asked(query: Mapping[str, str], axes: int) -> SignalsRequest:
    """Parse a query for raw signals; LivebodeError if it is invalid.

    >>> signals_asked({"axis": "0", "picture": "log", "at": "2.5"}, axes=1).at_s
    2.5
    """
    picture = query.get("picture", "time")
    if picture not in get_args(Picture):
        raise UsageError(
            "not-one-of",
            f"picture={picture[:20]!r} is not one of {', '.join(get_args(Picture))}",
            "choose one of them",
            argument="picture",
            value=picture[:20],
            allowed=list(get_args(Picture)),
        )
    axis = whole_number(query.get("axis", "0"), 0, axes - 1, "axis")
    return SignalsRequest(axis, cast(Picture, picture), moment(query))


def client_message(text: str, axes: int) -> ClientMessage:
    """Parse a message; LivebodeError if it is invalid.

    >>> client_message('{"kind": "watch", "axis": 0, "quantity": "open loop"}', axes=1).quantity
    'open loop'
    """
    if len(text) > MESSAGE_BYTES_MAX:
        raise ServerError(
            "request-malformed",
            f"the message is longer than {MESSAGE_BYTES_MAX} bytes",
            "send a shorter one",
            limit_bytes=MESSAGE_BYTES_MAX,
        )
    message = json_object(text, "message")
    kind = message.get("kind")
    if kind == "watch":
        axis = message.get("axis", 0)
        if isinstance(axis, bool) or not isinstance(axis, int):
            raise UsageError("unreadable", "axis is not a whole number", "give the number of an axis", argument="axis")
        quantity = message.get("quantity")
        asked_for = None if quantity is None else _quantity(quantity)
        return ClientMessage(kind, whole_number(str(axis)[:10], 0, axes - 1, "axis"), asked_for)
    if kind in ("pause", "resume"):
        return ClientMessage(kind)
    if kind == "unfreeze":
        return ClientMessage(kind, slot=_slot(message) if "slot" in message else None)
    if kind == "freeze":
        saved = message.get("saved")
        if saved is not None and not (isinstance(saved, str) and len(saved) <= _ID_MAX):
            raise UsageError("unreadable", "saved is not the id of a reference", "give its id", argument="saved")
        return ClientMessage(kind, time_s=_optional_time(message), slot=_slot(message), saved=saved)
    raise UsageError(
        "not-one-of",
        f"the message's kind {str(kind)[:20]!r} is not known",
        f"choose {', '.join(_KINDS)}",
        argument="kind",
        value=str(kind)[:20],
        allowed=list(_KINDS),
    )


def _slot(message: Mapping[str, Any]) -> int:
    slot = message.get("slot", 1)
    if isinstance(slot, bool) or not isinstance(slot, int):
        raise UsageError("unreadable", "slot is not a whole number", "give the number of a slot", argument="slot")
    return whole_number(str(slot)[:10], 1, REFERENCES_MAX, "slot")


def _optional_time(message: Mapping[str, Any]) -> float | None:
    time_s = message.get("time_s")
    if time_s is None:
        return None
    if isinstance(time_s, bool) or not isinstance(time_s, int | float):
        raise UsageError("unreadable", "time_s is not a number", "give seconds", argument="time_s")
    return _time(str(time_s)[:40])


def saved_change(data: bytes, axes: int) -> SavedChange:
    """Parse a change of what is saved with a run; LivebodeError if it is invalid.

    >>> saved_change(b'{"axis": 0, "kind": "annotation", "text": "belt", "frequency_hz": 62.5}', axes=1).value
    62.5
    """
    message = json_object(data)
    axis, kind = message.get("axis"), message.get("kind")
    place = {"reference": "time_s", "annotation": "frequency_hz", "remove": None}
    text = message.get("text")
    known = isinstance(kind, str) and kind in place and isinstance(axis, int) and not isinstance(axis, bool)
    if not known or not isinstance(text, str) or not text.strip() or len(text) > TEXT_MAX:
        raise ServerError(
            "request-malformed",
            f"a change needs axis, kind ({', '.join(place)}) and a text of at most {TEXT_MAX} characters",
            "send them",
        )
    check_letters(text, "text")
    number = whole_number(str(axis)[:10], 0, axes - 1, "axis")
    name = place[str(kind)]
    if name is None:
        return SavedChange(number, str(kind), text)
    position = message.get(name)
    if isinstance(position, bool) or not isinstance(position, int | float):
        raise UsageError("unreadable", f"{name} is not a number", "give a number", argument=name)
    value = _time(str(position)[:40])
    if kind == "annotation" and value <= 0:
        raise UsageError("unreadable", "frequency_hz is not positive", "give a frequency", argument=name)
    return SavedChange(number, str(kind), text.strip(), value)


def json_object(data: bytes | str, noun: str = "body") -> dict[str, Any]:
    """Parse a JSON object; ServerError if it is invalid, or has half of a letter, which no file and no answer can."""
    try:
        message = json.loads(data)
        json.dumps(message, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ServerError(
            "request-malformed", f"the {noun} has half of a letter (a surrogate)", "remove the letter"
        ) from None
    except (ValueError, RecursionError):
        raise ServerError("request-malformed", f"the {noun} is not JSON", "send an object of JSON") from None
    if not isinstance(message, dict):
        raise ServerError("request-malformed", f"the {noun} is not an object of JSON", "send one")
    return message


def check_letters(text: str, name: str) -> None:
    """UsageError if a text in one line has a letter that moves a terminal's cursor or turns the text around it."""
    if any(letter in _TURNING or unicodedata.category(letter) == "Cc" for letter in text):
        raise UsageError(
            "unreadable", Message("{name} contains a control character", name=name), "remove it", argument=name
        )


def _quantity(word: object) -> Quantity:
    for known in QUANTITIES:
        if word == known:
            return known
    raise UsageError(
        "not-one-of",
        f"quantity={str(word)[:20]!r} is not one of the quantities",
        f"choose {', '.join(QUANTITIES)}",
        argument="quantity",
        value=str(word)[:20],
        allowed=list(QUANTITIES),
    )


def _time(text: str) -> float:
    try:
        value = float(text[:40])
    except ValueError:
        value = math.nan
    if not abs(value) <= _TIME_S_MAX:
        raise UsageError(
            "unreadable",
            f"{text[:40]!r} is not a time in seconds",
            f"give seconds up to {_TIME_S_MAX:g}",
            value=text[:40],
        )
    return value


def whole_number(text: str, low: int, high: int, name: str) -> int:
    """Parse a whole number; UsageError outside of its range."""
    if text.isascii() and text.isdigit() and len(text) <= 10 and low <= int(text) <= high:
        return int(text)
    raise UsageError(
        "out-of-range",
        f"{name}={text[:20]!r} is not a whole number from {low} to {high}",
        f"choose one from {low} to {high}",
        argument=name,
        value=text[:20],
        low=low,
        high=high,
    )
