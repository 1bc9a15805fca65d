"""Passwords and tokens: from the environment or a file, held nowhere else, shown nowhere."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.core import ConfigError
from livebode.sources.live.settings import SourceSettings

SECRET_BYTES_MAX = 1 << 16


def password(settings: SourceSettings) -> str | None:
    """The password that the settings point to; None where they point to none.

    Raises
    ------
    ConfigError
        Where the variable is not set or the file cannot be read; the message names the key only, for in place of a
        name may be the password.
    """
    return secret("source", "password", settings.password_env, settings.password_file)


def secret(section: str, key: str, variable: str | None, path: Path | None) -> str | None:
    """What the section's `key`_env or `key`_file points to; None where neither is given, ConfigError as `password`."""
    if variable is not None and path is not None:
        raise ConfigError(
            "key-conflict",
            f"[{section}] has both {key}_env and {key}_file",
            "leave out one of them",
            key=section,
            keys=[f"{key}_env", f"{key}_file"],
        )
    if variable is not None:
        value = os.environ.get(variable)
        if value is None:
            raise ConfigError(
                "secret-missing",
                f"{section}.{key}_env names a variable that is not set",
                "set it, or correct its name",
                key=f"{section}.{key}_env",
            )
        return value
    return None if path is None else _in_file(path, f"{section}.{key}_file")


def _in_file(path: Path, key: str) -> str:
    """The text of a file without the line's end behind it."""
    try:
        if path.stat().st_size > SECRET_BYTES_MAX:
            raise ConfigError(
                "file-unusable",
                f"the file that {key} names is longer than {SECRET_BYTES_MAX} bytes",
                "check its name",
                key=key,
            )
        return path.read_text(encoding="utf-8").rstrip("\r\n")
    except UnicodeDecodeError:
        raise ConfigError(
            "file-unusable", f"the file that {key} names is not text", "check its name", key=key
        ) from None
    except OSError as error:
        raise ConfigError(
            "file-unreadable",
            f"the file that {key} names cannot be read: {error.strerror}",
            "check its name and permissions",
            key=key,
        ) from None


def existing(path: Path, what: str) -> str:
    """The path as text; ConfigError where there is no readable file."""
    if not path.is_file():
        raise ConfigError(
            "file-unreadable",
            f"there is no file {path} for source.{what}",
            "check the name",
            key=f"source.{what}",
            path=str(path),
        )
    return str(path)
