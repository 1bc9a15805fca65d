"""Runs that cannot be read, written or continued."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class RecordError(LivebodeError):
    """A run's directory cannot be read, written or continued."""

    area: ClassVar[str] = "record"
    codes: ClassVar[Mapping[str, str]] = {}
