"""Files that cannot be written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class OutputError(LivebodeError):
    """A file that was asked for cannot be written."""

    area: ClassVar[str] = "output"
    codes: ClassVar[Mapping[str, str]] = {
        "exists": "The file exists already.",
        "is-directory": "The path of the file is a directory.",
        "not-written": "The system refuses to write the file.",
        "too-large": "There are more values than can be written in this format.",
    }
