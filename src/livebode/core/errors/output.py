"""Files that cannot be written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class OutputError(LivebodeError):
    """A file that was asked for cannot be written."""

    area: ClassVar[str] = "output"
    codes: ClassVar[Mapping[str, str]] = {
        "exists": "The file exists already, and may be replaced only on request.",
        "not-written": "The disk or its permissions prevented the output from being written.",
    }
