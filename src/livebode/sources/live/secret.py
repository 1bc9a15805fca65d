"""Passwords and tokens: from the environment or a file, held nowhere else, shown nowhere."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.core import InputError
from livebode.sources.live.settings import SourceSettings

SECRET_BYTES_MAX = 1 << 16


def password(settings: SourceSettings) -> str | None:
    """The password that the settings point to; None where they point to none.

    Raises
    ------
    InputError
        Where the variable is not set or the file cannot be read; the message names it, never what is in it.
    """
    return secret("source", "password", settings.password_env, settings.password_file)


def secret(section: str, key: str, variable: str | None, path: Path | None) -> str | None:
    """What the section's `key`_env or `key`_file points to; None where neither is given, InputError as `password`."""
    if variable is not None and path is not None:
        raise InputError(f"{section} has both {key}_env and {key}_file; leave out one of them")
    if variable is not None:
        value = os.environ.get(variable)
        if value is None:
            raise InputError(f"the environment has no {variable!r}, which {section}.{key}_env names; set it")
        return value
    return None if path is None else _in_file(path)


def _in_file(path: Path) -> str:
    """The text of a file without the line's end behind it."""
    try:
        if path.stat().st_size > SECRET_BYTES_MAX:
            raise InputError(f"{path} is longer than {SECRET_BYTES_MAX} bytes; is it the password?")
        return path.read_text(encoding="utf-8").rstrip("\r\n")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not text; is it the password?") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; check its name and permissions") from None


def existing(path: Path, what: str) -> str:
    """The path as text; InputError where there is no readable file."""
    if not path.is_file():
        raise InputError(f"there is no file {path} for source.{what}; check the name")
    return str(path)
