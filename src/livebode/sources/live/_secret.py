"""Passwords and tokens: from the environment or a file; never stored elsewhere, never shown."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.core import ConfigError

SECRET_BYTES_MAX = 1 << 16


def password(variable: str | None, path: Path | None) -> str | None:
    """The password of [source], in the environment variable or the file; None if neither is given.

    Raises
    ------
    ConfigError
        Where the variable is not set or the file cannot be read; the message names the key only, for in place of a
        name may be the password.
    """
    return secret("source", "password", variable, path)


def secret(section: str, key: str, variable: str | None, path: Path | None) -> str | None:
    """The secret at the section's `key`_env or `key`_file; None if neither is given, ConfigError as `password`."""
    if variable is not None and path is not None:
        raise ConfigError(
            "key-conflict",
            f"[{section}] has both {key}_env and {key}_file",
            "remove one of them",
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
    """The text of a file without a line break at its end."""
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
    """The path as text; ConfigError if there is no readable file."""
    if not path.is_file():
        raise ConfigError(
            "file-unreadable",
            f"there is no file {path} for source.{what}",
            "check the name",
            key=f"source.{what}",
            path=str(path),
        )
    return str(path)
