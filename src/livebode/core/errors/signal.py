"""Signals that give no response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role."""

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {}
