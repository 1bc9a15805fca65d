"""Baselines that cannot be learned or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class BaselineError(LivebodeError):
    """A baseline cannot be learned, read, or compared with this run."""

    area: ClassVar[str] = "baseline"
    codes: ClassVar[Mapping[str, str]] = {}
