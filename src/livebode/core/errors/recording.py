"""Recordings that cannot be read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class RecordingError(LivebodeError):
    """A file with recorded samples cannot be read, or is not what was asked for."""

    area: ClassVar[str] = "recording"
    codes: ClassVar[Mapping[str, str]] = {
        "file-unreadable": "The file cannot be read.",
        "not-an-excitation": "The file is not an excitation that `livebode design` wrote.",
    }
