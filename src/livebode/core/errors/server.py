"""A dashboard that cannot be served."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ServerError(LivebodeError):
    """The dashboard cannot be served or reached."""

    area: ClassVar[str] = "server"
    codes: ClassVar[Mapping[str, str]] = {}
