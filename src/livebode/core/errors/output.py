"""Files that cannot be written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class OutputError(LivebodeError):
    """A file that was asked for cannot be written."""

    area: ClassVar[str] = "output"
    codes: ClassVar[Mapping[str, str]] = {
        "exists": "The directory exists already.",
        "not-replaceable": "The directory contains something else than an earlier output, and is not replaced.",
        "write-failed": "A file or directory cannot be written.",
    }
