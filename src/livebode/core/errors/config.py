"""What is wrong in a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ConfigError(LivebodeError):
    """A configuration (axis.toml, experiment.toml) cannot be read, or has a key or value that cannot be used."""

    area: ClassVar[str] = "config"
    codes: ClassVar[Mapping[str, str]] = {
        "file-unreadable": "A file that the configuration names does not exist or cannot be read.",
        "file-unusable": "A file that the configuration names has other content than it needs.",
        "key-conflict": "Two keys that exclude each other are set.",
        "key-missing": "A required key is not set.",
        "key-unused": "A key has no meaning for this kind of source.",
        "secret-in-url": "A URL contains a user or password, which would be recorded.",
        "secret-missing": "The environment variable that holds a secret is not set.",
        "value-invalid": "The value of a key is not of the form that the key needs.",
    }
