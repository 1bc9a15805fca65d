"""What people write instead of TOML, and the line that they mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

_AT_LINE = re.compile(r"\(at line (\d+), ")  # tomllib has no attribute for it before Python 3.14
_KEY = r"(\s*[A-Za-z0-9_.\"-]+\s*)"
_ESCAPED = {"\t": r"\t", "\b": r"\b", "\f": r"\f", "\n": r"\n", "\r": r"\r", "\x1b": r"\e"}


def mistake_at(error: str, text: str) -> tuple[int, str] | None:
    """Number and text of the line that an error of tomllib is about; None if it names none.

    An error at the end of a line is about the beginning of the next one.
    """
    found = _AT_LINE.search(error)
    lines = text.splitlines()
    if found is None or not 0 < int(found[1]) <= len(lines):
        return None
    return int(found[1]), lines[int(found[1]) - 1].strip()


def meant_lines(line: str) -> Iterator[str]:
    """What was perhaps meant by a line that is not TOML, the more usual mistakes first."""
    colon = re.sub(rf"^{_KEY}:\s*", lambda found: f"{found[1].rstrip()} = ", line)
    for start in (line, colon):
        yield start
        for change in _CHANGES:
            yield change(start)


def _changed(pattern: str, replacement: str | Callable[[re.Match[str]], str]) -> Callable[[str], str]:
    return lambda line: re.sub(pattern, replacement, line)


_CHANGES = (
    _changed(r'"([^"]*\\[^"]*)"', r"'\1'"),
    _changed("[“”„«»]", '"'),
    _changed("[‘’‚]", "'"),
    _changed(r"^\s*(;|//)", "#"),
    _changed(r"(=\s*[+-]?\d+),(\d+)(?=\s*(#|$))", r"\1.\2"),
    _changed(r"=\s*(True|False|TRUE|FALSE)\b", lambda found: f"= {found[1].lower()}"),
    _changed(r"^(\s*\[[^\]#]*?)\s*$", r"\1]"),
    _changed(r"=\s*([^\s\"'\[{#][^#\"']*?)\s*(#.*)?$", lambda found: f'= "{found[1]}"' + f" {found[2] or ''}".rstrip()),
    _changed(r"=\s*\"([^\"]*)$", r'= "\1"'),
    _changed(r"=\s*'([^']*)$", r"= '\1'"),
    _changed(r"=\s*([^\"]*)\"$", r'= "\1"'),
)
"""A path in double quotes, typographic quotes, a comment of another language, a decimal comma, a word of another
language, a bracket or quotes that are missing."""


def meant_path(value: str) -> str | None:
    r"""A Windows path whose backslashes were read as escapes, as it was written; None if it is not one.

    >>> meant_path("C:" + chr(9) + "emp" + chr(8) + "ode.csv")
    'C:\\temp\\bode.csv'
    """
    if not any(letter in value for letter in _ESCAPED):
        return None
    written = "".join(_ESCAPED.get(letter, letter) for letter in value)
    return written if written.isprintable() and re.match(r"[A-Za-z]:|\\|\.", written) else None
