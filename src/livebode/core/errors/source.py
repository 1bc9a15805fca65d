"""Live sources that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SourceError(LivebodeError):
    """A live source cannot be opened, or sends what cannot be used."""

    area: ClassVar[str] = "source"
    codes: ClassVar[Mapping[str, str]] = {}
