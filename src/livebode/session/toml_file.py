"""A configuration's file: TOML of bounded size, as plain data."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from livebode.nouns import InputError

FILE_BYTES_MAX = 1 << 20
_SHOWN = 120


def read_table(path: Path) -> dict[str, Any]:
    """What is in a TOML file; InputError where it cannot be read, is not TOML, or is longer than 1 MiB."""
    return parse_table(read_bytes(path), str(path))


def read_bytes(path: Path) -> bytes:
    """The file as it is, at most a byte more than may be; InputError where it cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(FILE_BYTES_MAX + 1)
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; check the name") from None
    except OSError as error:
        raise InputError(f"{str(path)!r} cannot be read: {error.strerror}") from None


def parse_table(data: bytes, origin: str) -> dict[str, Any]:
    """What is in the text of a TOML file; `origin` names it in messages."""
    if len(data) > FILE_BYTES_MAX:
        raise InputError(f"{origin!r} is longer than {FILE_BYTES_MAX} bytes; is it a configuration?")
    try:
        return tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError:
        raise InputError(f"{origin!r} is not text; give a configuration in TOML, or a recording") from None
    except RecursionError:
        raise InputError(f"{origin!r} is not a configuration: its values are nested too deeply") from None
    except ValueError as error:  # also a number of more digits than Python reads
        raise InputError(f"{origin!r} is not TOML: {one_line(str(error))}") from None


def shortened(value: Any) -> str:
    """A value in a message, however long it is."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deeply, or more digits than Python writes
        return "that"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"


def one_line(text: str) -> str:
    """Text of a user in a message: printable, and not endless.

    >>> one_line("lines.\\n")
    'lines. '
    """
    shown = "".join(letter if letter.isprintable() else " " for letter in text[: 4 * _SHOWN])
    return shown if len(text) <= 2 * _SHOWN else shown[: 2 * _SHOWN] + "…"
