"""Arguments of a call or options of a command that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class UsageError(LivebodeError):
    """An argument of a call, or an option of a command, cannot be used."""

    area: ClassVar[str] = "usage"
    codes: ClassVar[Mapping[str, str]] = {
        "conflict": "Two arguments exclude each other, or one does not fit the others.",
        "missing": "An argument is needed and not given.",
        "not-finite": "An argument with several numbers has one that is not finite, or only zeros.",
        "not-one-of": "An argument is not one of the values that it may have.",
        "options": "The options of a command cannot be used as given.",
        "out-of-memory": "There is not enough memory for these settings.",
        "out-of-range": "A number is outside the range that the argument allows.",
        "unknown-name": "A name in an argument is not among the names that exist.",
        "unreadable": "A text or value cannot be read as what the argument takes.",
        "wrong-shape": "An array has the wrong number of dimensions or values.",
    }
