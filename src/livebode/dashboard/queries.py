"""Requests of a browser: queries and web-socket messages, validated to plain values."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from livebode.core import Quantity, ServerError, UsageError
from livebode.dashboard.quantities import QUANTITIES

MESSAGE_BYTES_MAX = 1024
_FORMATS = ("csv", "mat")
_KINDS = ("watch", "pause", "resume", "freeze", "unfreeze")
_TIME_S_MAX = 1e12


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
    `freeze` makes the newest response, or the one at `time_s`, the reference, `unfreeze` removes it.
    """

    kind: str
    axis: int = 0
    quantity: Quantity | None = None
    time_s: float | None = None


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
    rows = _whole(query.get("rows", "1200"), 1, 1 << 20, "rows")
    axis = _whole(query.get("axis", "0"), 0, axes - 1, "axis")
    return Span(axis, _quantity(query.get("quantity", "plant")), from_s, to_s, rows, format)


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
    message = plain(text, "message")
    kind = message.get("kind")
    if kind == "watch":
        axis = message.get("axis", 0)
        if isinstance(axis, bool) or not isinstance(axis, int):
            raise UsageError("unreadable", "axis is not a whole number", "give the number of an axis", argument="axis")
        quantity = message.get("quantity")
        asked_for = None if quantity is None else _quantity(quantity)
        return ClientMessage(kind, _whole(str(axis)[:10], 0, axes - 1, "axis"), asked_for)
    if kind in ("pause", "resume", "unfreeze"):
        return ClientMessage(kind)
    if kind == "freeze":
        time_s = message.get("time_s")
        if time_s is not None:
            if isinstance(time_s, bool) or not isinstance(time_s, int | float):
                raise UsageError("unreadable", "time_s is not a number", "give seconds", argument="time_s")
            time_s = _time(str(time_s)[:40])
        return ClientMessage(kind, time_s=time_s)
    raise UsageError(
        "not-one-of",
        f"the message's kind {str(kind)[:20]!r} is not known",
        f"choose {', '.join(_KINDS)}",
        argument="kind",
        value=str(kind)[:20],
        allowed=list(_KINDS),
    )


def acknowledged(data: bytes, axes: int) -> tuple[int, str]:
    """Axis and event of an acknowledgement; LivebodeError if it is invalid."""
    message = plain(data)
    axis, event = message.get("axis"), message.get("event")
    if isinstance(axis, bool) or not isinstance(axis, int) or not isinstance(event, str) or len(event) > 64:
        raise ServerError("request-malformed", "the acknowledgement does not have an axis and an event", "send both")
    return _whole(str(axis)[:10], 0, axes - 1, "axis"), event


def plain(data: bytes | str, what: str = "body") -> dict[str, Any]:
    """Parse a JSON object; ServerError if it is invalid."""
    try:
        message = json.loads(data)
    except (ValueError, RecursionError):
        raise ServerError("request-malformed", f"the {what} is not JSON", "send an object of JSON") from None
    if not isinstance(message, dict):
        raise ServerError("request-malformed", f"the {what} is not an object of JSON", "send one")
    return message


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


def _whole(text: str, low: int, high: int, name: str) -> int:
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
