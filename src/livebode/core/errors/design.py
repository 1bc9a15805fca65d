"""Excitations that cannot be made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class DesignError(LivebodeError):
    """An excitation or experiment that meets the specification and the limits cannot be made."""

    area: ClassVar[str] = "design"
    codes: ClassVar[Mapping[str, str]] = {}
