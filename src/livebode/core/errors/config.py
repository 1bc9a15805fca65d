"""What is wrong in a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ConfigError(LivebodeError):
    """A configuration (axis.toml, experiment.toml) cannot be read, or has a key or value that cannot be used."""

    area: ClassVar[str] = "config"
    codes: ClassVar[Mapping[str, str]] = {}
