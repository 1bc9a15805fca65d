"""Requests of the page of all runs, validated to plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from livebode.core import ServerError, UsageError
from livebode.dashboard.queries import json_object
from livebode.language import Message
from livebode.records import Notes

NAME_LETTERS_MAX = 255
VERSION_MAX = 1 << 53


def version(query: Mapping[str, str]) -> int:
    """The version that the page has; 0 without one.

    >>> version({"since": "12"}), version({})
    (12, 0)
    """
    text = query.get("since", "0")
    if not (text.isascii() and text.isdigit() and len(text) <= 16 and int(text) <= VERSION_MAX):
        raise UsageError(
            "unreadable", f"since={text[:20]!r} is not a version", Message("reload the page"), value=text[:20]
        )
    return int(text)


def run_name(value: object) -> str:
    """The name of a run in a request."""
    if not isinstance(value, str) or not 0 < len(value) <= NAME_LETTERS_MAX:
        raise ServerError("request-malformed", "the request does not name a run", Message("reload the page"))
    return value


def notes_of(data: bytes | None) -> tuple[str, Notes]:
    """Name and notes of a request; LivebodeError if they are invalid."""
    message = _object(data)
    try:
        notes = Notes.model_validate({name: message.get(name) for name in ("tags", "text")})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ServerError(
            "request-malformed",
            f"the notes are not valid ({place}: {first['msg']})",
            "shorten them: at most 20 tags of 40 letters, and 2,000 letters of notes",
        ) from None
    return run_name(message.get("run")), notes


def deletion_of(data: bytes | None) -> str:
    """Name of the run to delete; ServerError if the person did not confirm it by its name."""
    message = _object(data)
    name = run_name(message.get("run"))
    if message.get("confirmed") != name:
        raise ServerError("request-malformed", f"the deletion of {name[:80]!r} is not confirmed", "enter its name")
    return name


def _object(data: bytes | None) -> dict[str, Any]:
    if data is None:
        raise ServerError("request-malformed", "the request is too long or incomplete", "send a shorter one")
    return json_object(data)
