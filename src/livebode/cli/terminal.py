"""The one way to a terminal: what comes from files, senders and users cannot command it.

Every text that is printed has its control characters made visible; colours and movements of the cursor are Rich's and
the plot's alone.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO, cast

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

# Also what turns the direction of writing, which shows a text as another one.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
_COLOUR = re.compile("(\x1b\\[[0-9;]*m)")


def visible(text: str) -> str:
    r"""The text with control characters, but for new lines and tabs, as escapes that JSON knows, too.

    >>> visible("belt\x1b[2J\u202e ok")
    'belt\\u001b[2J\\u202e ok'
    """
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class VisibleText(io.TextIOWrapper):
    """A text stream that prints control characters as their escapes. It has no colours, so it claims no terminal.

    `unchecked` is the stream that was there before.
    """

    def __init__(self, unchecked: io.TextIOWrapper) -> None:
        encoding, lines = unchecked.encoding, unchecked.line_buffering
        super().__init__(
            unchecked.buffer, encoding=encoding, errors="replace", line_buffering=lines, write_through=True
        )
        self.unchecked = unchecked

    def write(self, text: str) -> int:
        """Write text, made visible."""
        super().write(visible(text))
        return len(text)

    def isatty(self) -> bool:
        """Never: who asks would write what is for terminals only."""
        return False


class SafeConsole(Console):
    """Rich on a terminal: what it renders is made visible, what it commands is not touched."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """As Rich does."""
        return _made_visible(super().render(renderable, options))

    def render_str(self, text: str, **options: Any) -> Text:
        """As Rich does; made visible before it is measured, so that columns are wide enough."""
        return super().render_str(visible(text), **options)

    def on_broken_pipe(self) -> None:
        """Leave it to the entry point, which knows what to do; Rich would end with 1."""
        raise BrokenPipeError


def protect() -> None:
    """Make standard output and standard error print control characters as their escapes from here on."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and not isinstance(stream, VisibleText):
            # A terminal that lacks a letter shows another one, rather than nothing and an error.
            stream.reconfigure(errors="replace")
            setattr(sys, name, VisibleText(stream))


@contextmanager
def unchecked_output() -> Iterator[None]:
    """Within, what is printed may command the terminal: for texts of the program alone, such as its help."""
    before = sys.stdout
    before.flush()
    sys.stdout = _unchecked()
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stdout = before


def console(*, stderr: bool = False, **options: Any) -> Console:
    """Rich on standard output or standard error."""
    return SafeConsole(file=_unchecked(stderr=stderr), highlight=False, **options)


def is_terminal() -> bool:
    """Whether standard output is a terminal."""
    return _unchecked().isatty()


def print_drawn(text: str) -> None:
    """Print a drawing of ours that may have colours."""
    sys.stdout.flush()
    parts = _COLOUR.split(text)  # every second one is a colour
    parts[::2] = map(visible, parts[::2])
    print("".join(parts), file=_unchecked(), flush=True)


def _unchecked(*, stderr: bool = False) -> TextIO:
    stream = sys.stderr if stderr else sys.stdout
    return stream.unchecked if isinstance(stream, VisibleText) else cast("TextIO", stream)


def _made_visible(segments: Iterable[Segment]) -> Iterator[Segment]:
    for segment in segments:
        yield segment if segment.control else Segment(visible(segment.text), segment.style)
