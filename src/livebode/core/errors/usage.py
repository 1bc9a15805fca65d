"""Arguments of a call or options of a command that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class UsageError(LivebodeError):
    """An argument of a call, or an option of a command, cannot be used."""

    area: ClassVar[str] = "usage"
    codes: ClassVar[Mapping[str, str]] = {
        "duplicate": "A name is given twice where each may be given once.",
        "missing": "A required argument is missing or empty.",
        "out-of-range": "The value is outside the range of the argument.",
    }
