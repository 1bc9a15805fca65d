"""Passwords: from the environment or a file, held nowhere else, shown nowhere."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.nouns import InputError
from livebode.sources.live.settings import SourceSettings

SECRET_BYTES_MAX = 1 << 16


def password(settings: SourceSettings) -> str | None:
    """The password that the settings point to; None where they point to none.

    Raises
    ------
    InputError
        Where the variable is not set or the file cannot be read; the message names it, never what is in it.
    """
    if settings.password_env is not None and settings.password_file is not None:
        raise InputError("source has both password_env and password_file; leave out one of them")
    if settings.password_env is not None:
        value = os.environ.get(settings.password_env)
        if value is None:
            raise InputError(
                f"the environment has no {settings.password_env!r}, which source.password_env names; set it"
            )
        return value
    if settings.password_file is not None:
        return secret_file(settings.password_file)
    return None


def secret_file(path: Path) -> str:
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
