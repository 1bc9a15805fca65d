"""Arguments of a call or options of a command that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class UsageError(LivebodeError):
    """An argument of a call, or an option of a command, cannot be used."""

    area: ClassVar[str] = "usage"
    codes: ClassVar[Mapping[str, str]] = {
        "conflict": "Arguments contradict each other, or exclude each other.",
        "duplicated": "A name or value that may occur once is given twice.",
        "invalid-name": "A text cannot be the name that it is meant for.",
        "missing": "A required argument is missing or empty.",
        "not-finite": "A value is infinite or not a number.",
        "not-one-of": "A value is not one of those that the argument allows.",
        "out-of-range": "The value is outside the range of the argument.",
        "too-many": "There are more values than the argument allows.",
        "unknown-name": "A name does not exist in what it refers to.",
        "unreadable": "The text of an argument cannot be read.",
        "wrong-shape": "The shape or number of values does not fit.",
    }
