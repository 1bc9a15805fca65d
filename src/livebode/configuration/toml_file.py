"""A configuration's file: TOML of bounded size, as plain data."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from typing import Any

from livebode.core import ConfigError, LivebodeError

FILE_BYTES_MAX = 1 << 20
_SHOWN = 120
_TWICE = ("Cannot overwrite a value", "Cannot declare (")
"""How the errors of tomllib begin that are about a line and an earlier one."""
_QUOTED = re.compile(r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*', re.DOTALL)
_BETWEEN_KEYS, _PARTS_MAX = re.compile(r"[,=\[\]{}\n]"), 64
"""For a key of many parts tomllib takes the square of their number."""
_TEXT_MAX, _LINES_MAX, _DEPTH_MAX, _INTEGER_MAX = 500, 20_000, 12, 1 << 63


def read_table(path: Path) -> dict[str, Any]:
    """Content of a TOML file; ConfigError if it cannot be read, is not TOML, or is longer than 1 MiB."""
    return parse_table(read_bytes(path), str(path))


def read_bytes(path: Path) -> bytes:
    """Bytes of the file, at most one more than allowed; ConfigError if it cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(FILE_BYTES_MAX + 1)
    except FileNotFoundError:
        raise ConfigError("file-unreadable", f"there is no file {path}", "check the name", path=str(path)) from None
    except OSError as error:
        raise ConfigError(
            "file-unreadable",
            f"{str(path)!r} cannot be read: {error.strerror}",
            "check the path and its permissions",
            path=str(path),
            errno=error.errno,
        ) from None


def parse_table(data: bytes, origin: str) -> dict[str, Any]:
    """Content of the text of a TOML file; `origin` names it in messages."""
    if len(data) > FILE_BYTES_MAX:
        raise ConfigError(
            "file-too-long",
            f"{origin!r} is longer than {FILE_BYTES_MAX} bytes",
            "check that it is a configuration",
            path=origin,
            limit_bytes=FILE_BYTES_MAX,
        )
    import tomllib  # not of a run without a configuration

    try:
        text = _decoded(data)
        if any(part.count(".") > _PARTS_MAX for part in _BETWEEN_KEYS.split(_QUOTED.sub("", text))):
            raise _too_deep(origin)
        found = tomllib.loads(text)
        _check_texts(found, "", origin, 0)
        return found
    except UnicodeDecodeError as error:
        raise _not_utf8(data, error.start, origin) from None
    except RecursionError:
        raise _too_deep(origin) from None
    except LivebodeError:
        raise
    except ValueError as error:  # also a number with more digits than Python can parse
        raise _not_toml(text, str(error), origin) from None


def _decoded(data: bytes) -> str:
    """The text; an editor of Windows writes a byte order mark first, or UTF-16."""
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16" if is_utf16 else "utf-8-sig").replace("\r\n", "\n")


def meant_line(line: str) -> str | None:
    r"""The line of TOML that was probably meant, which is one; None if nothing usual is wrong.

    >>> meant_line('log = "C:\\data\\log.csv"'), meant_line("output = velocity"), meant_line('output: "y"')
    ("log = 'C:\\data\\log.csv'", 'output = "velocity"', 'output = "y"')
    >>> meant_line("rate_hz = 0,5  # kHz"), meant_line("average = True"), meant_line("frequencies: 20:140:20")
    ('rate_hz = 0.5  # kHz', 'average = true', 'frequencies = "20:140:20"')
    >>> meant_line("output = “y”"), meant_line("// my axis"), meant_line('output = "y'), meant_line("[source")
    ('output = "y"', '# my axis', 'output = "y"', '[source]')
    """
    from livebode.configuration.toml_mistakes import meant_lines  # needed for a mistake only

    if len(line) > _TEXT_MAX:  # too long to be written by hand; the patterns take the square of its length
        return None
    return next((meant for meant in meant_lines(line) if meant != line and _is_toml(meant)), None)


def _is_toml(line: str) -> bool:
    import tomllib

    try:
        tomllib.loads(line)
    except ValueError:
        return False
    return True


def _not_utf8(data: bytes, at: int, origin: str) -> ConfigError:
    """The error of a binary file, or of one with another encoding, by its first letter that is not UTF-8."""
    if b"\0" in data:
        return ConfigError(
            "not-text", f"{origin!r} is not text", "give a configuration in TOML, or a recording", path=origin
        )
    begin, number = data.rfind(b"\n", 0, at) + 1, data.count(b"\n", 0, at) + 1
    line = data[begin:].partition(b"\n")[0].decode("cp1252", "replace").strip()
    return ConfigError(
        "not-text",
        f"{origin!r} is not UTF-8 in line {number}: {one_line(line)}",
        "save it with the encoding UTF-8, in Notepad by Save as",
        path=origin,
        line=number,
    )


def _not_toml(text: str, why: str, origin: str) -> ConfigError:
    """The error of tomllib, with the line and what was probably meant."""
    from livebode.configuration.toml_mistakes import mistake_at, without_thousands  # needed for a mistake only

    found = mistake_at(why, text)
    if found is not None and why.startswith(_TWICE):
        return ConfigError(
            "not-toml",
            f"{origin!r} is not TOML in line {found[0]}: {one_line(found[1])}",
            "it is in the file twice; remove one, and write the keys of a section below one header",
            path=origin,
            line=found[0],
        )
    meant = None if found is None else meant_line(found[1])
    if found is None or meant is None:
        return ConfigError("not-toml", f"{origin!r} is not TOML: {one_line(why)}", "correct it there", path=origin)
    remedy = f"write {one_line(meant)}"
    if without_thousands(found[1]) == meant:
        remedy += f", or {found[1].replace(',', '.', 1)} if the comma is a decimal one"
    if "\\" in meant:
        remedy += f" or {one_line(meant.replace(chr(92), '/'))}"
    return ConfigError(
        "not-toml", f"{origin!r} is not TOML in line {found[0]}: {one_line(found[1])}", remedy,
        path=origin, line=found[0],
    )  # fmt: skip


def shortened(value: Any) -> str:
    """A value shortened for a message."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deeply, or more digits than Python can print
        return "that"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"


def one_line(text: str) -> str:
    """Text of a user in a message: printable and of limited length.

    >>> one_line("lines.\\n")
    'lines. '
    """
    shown = "".join(letter if letter.isprintable() else " " for letter in text[: 4 * _SHOWN])
    return shown if len(text) <= 2 * _SHOWN else shown[: 2 * _SHOWN] + "…"


def _too_deep(origin: str) -> ConfigError:
    return ConfigError(
        "nested-too-deeply",
        f"{origin!r} is not a configuration: its values are nested too deeply",
        "check the file",
        path=origin,
    )


def _check_texts(value: Any, place: str, origin: str, depth: int) -> None:
    if depth > _DEPTH_MAX:
        raise _too_deep(origin)
    if isinstance(value, dict):
        for key, inner in value.items():
            _check_text(key, f"a key in [{place}]" if place else "a key", origin)
            _check_texts(inner, f"{place}.{key}" if place else key, origin, depth + 1)
    elif isinstance(value, list):
        for inner in value:
            _check_texts(inner, place, origin, depth + 1)
    elif isinstance(value, str):
        _check_text(value, place, origin)
    elif isinstance(value, int) and abs(value) >= _INTEGER_MAX:  # TOML's limit; Python cannot print some larger ones
        raise ConfigError(
            "value-invalid",
            f"{place} is a whole number of {value.bit_length()} bits, more than 63",
            "correct it",
            key=place,
        ).at(origin)


def _check_text(text: str, place: str, origin: str) -> None:
    long = _LINES_MAX if place.endswith("frequencies") else _TEXT_MAX
    if len(text) > long:
        raise ConfigError(
            "value-invalid",
            f"{place} has {len(text)} letters, more than {long}",
            "shorten it",
            key=place,
            limit=long,
        ).at(origin)
    if not text.isprintable():
        _check_escapes(text, place, origin)
        raise ConfigError(
            "value-invalid",
            f"{place} = {shortened(text)} has a letter that cannot be printed",
            "remove it",
            key=place,
            value=shortened(text),
        ).at(origin)


def _check_escapes(text: str, place: str, origin: str) -> None:
    """ConfigError for a Windows path in double quotes, whose backslashes became control characters."""
    from livebode.configuration.toml_mistakes import meant_path  # needed for a mistake only

    if (path := meant_path(text)) is not None:
        raise ConfigError(
            "value-invalid",
            f"{place} = {shortened(text)} has a backslash in double quotes, which begins a special letter",
            f"write '{path}' in single quotes, or {path.replace(chr(92), '/')}",
            key=place,
            value=shortened(text),
        ).at(origin)
