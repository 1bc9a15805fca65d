"""Text for a terminal: in frames, as help and errors have it, and with its control characters made visible.

Rich draws such frames too, but takes longer to load than most commands take to fail.
"""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Iterable, Iterator
from typing import TextIO

MINIMUM_WIDTH = 40
BOLD, DIM, RED, YELLOW, CYAN = "\x1b[1m", "\x1b[2m", "\x1b[31m", "\x1b[1;33m", "\x1b[1;36m"
_END = "\x1b[0m"
_ASCII = str.maketrans("╭╮╰╯─│", "++++-|")
_TEXT_MINIMUM = 24
"""Columns of a text beside its name; with fewer it is below."""


# Also characters that change the direction of writing: they can disguise a text.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def terminal_width(stream: TextIO | None) -> int:
    """The columns for what is printed there, 80 if it is not a terminal."""
    columns = os.environ.get("COLUMNS", "")
    found = int(columns) if columns.isdecimal() else 0
    if not found and stream is not None and stream.isatty():
        found = os.get_terminal_size(stream.fileno()).columns
    return max(MINIMUM_WIDTH, found or 80)


def has_colours(stream: TextIO | None) -> bool:
    """Whether it is a terminal that shows colours."""
    allowed = os.name == "posix" and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
    return stream is not None and stream.isatty() and allowed


def visible(text: str) -> str:
    r"""Replace control characters, except new lines and tabs, by JSON escapes.

    >>> visible("belt\x1b[2J\u202e ok")
    'belt\\u001b[2J\\u202e ok'
    """
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def printable(text: str, stream: TextIO | None) -> str:
    """The text with frames of ASCII where the encoding has no others."""
    utf = "utf" in (getattr(stream, "encoding", None) or "").lower()
    return text if utf else text.translate(_ASCII)


def styled(text: str, style: str, *, colours: bool) -> str:
    """The text in this style."""
    return f"{style}{text}{_END}" if colours else text


def usage(text: str, *, colours: bool) -> str:
    """The line with the usage of a command."""
    return f" {styled('Usage: ', YELLOW, colours=colours)}{styled(text, BOLD, colours=colours)}"


def paragraph(text: str, width: int) -> list[str]:
    """The lines of a text without a frame."""
    return textwrap.wrap(text, width, initial_indent=" ", subsequent_indent=" ", break_on_hyphens=False)


def table(title: str, rows: Iterable[tuple[str, str]], width: int, *, colours: bool) -> Iterator[str]:
    """A frame with names and a text for each: beside the names or, in a narrow terminal, below."""
    rows = list(rows)
    names = max(len(name) for name, _ in rows)
    texts = width - names - 6
    lines: list[tuple[str, str]] = []
    for name, text in rows:
        if texts >= _TEXT_MINIMUM:
            lines += zip([f"{name:{names}}  ", *[" " * (names + 2)] * len(text)], _wrapped(text, texts))
        else:
            lines += [(part, "") for part in _wrapped(name, width - 4)]
            lines += [("    ", part) for part in _wrapped(text, width - 8)]
    yield from frame(title, lines, width, colours=colours)


def frame(
    title: str, lines: Iterable[tuple[str, str]], width: int, *, colours: bool, border: str = DIM
) -> Iterator[str]:
    """A frame around lines, each a name and a text."""
    side = styled("│", border, colours=colours)
    yield styled(f"╭─ {title} {'─' * (width - len(title) - 5)}╮", border, colours=colours)
    for name, text in lines:
        rest = width - 4 - len(name)
        shown = styled(name, CYAN, colours=colours and not name.isspace() and name != "")
        yield f"{side} {shown}{text:{rest}} {side}"
    yield styled(f"╰{'─' * (width - 2)}╯", border, colours=colours)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_on_hyphens=False)
