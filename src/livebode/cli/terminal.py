"""Output to the terminal: text from files, sources and users cannot control it.

Control characters in printed text are made visible. Only Rich and the plot write colours and cursor movements.
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

# Also characters that change the direction of writing: they can disguise a text.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
_COLOUR = re.compile("(\x1b\\[[0-9;]*m)")


def visible(text: str) -> str:
    r"""Replace control characters, except new lines and tabs, by JSON escapes.

    >>> visible("belt\x1b[2J\u202e ok")
    'belt\\u001b[2J\\u202e ok'
    """
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class VisibleText(io.TextIOWrapper):
    """A text stream that prints control characters as escapes. It has no colours, so it is not a terminal.

    `unchecked` is the stream that it replaces.
    """

    def __init__(self, unchecked: io.TextIOWrapper) -> None:
        encoding, lines = unchecked.encoding, unchecked.line_buffering
        super().__init__(
            unchecked.buffer, encoding=encoding, errors="replace", line_buffering=lines, write_through=True
        )
        self.unchecked = unchecked

    def write(self, text: str) -> int:
        """Write text with its control characters made visible."""
        super().write(visible(text))
        return len(text)

    def isatty(self) -> bool:
        """False: a caller that asks would write escape codes."""
        return False


class SafeConsole(Console):
    """A Rich console that makes control characters in text visible and passes its own control codes."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render with control characters made visible."""
        return _made_visible(super().render(renderable, options))

    def render_str(self, text: str, **options: Any) -> Text:
        """Render a string; made visible before Rich measures it, so that columns are wide enough."""
        return super().render_str(visible(text), **options)

    def on_broken_pipe(self) -> None:
        """Raise, so that `main` handles it; Rich would exit with 1."""
        raise BrokenPipeError


def protect() -> None:
    """Make standard output and standard error print control characters as escapes."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and not isinstance(stream, VisibleText):
            # A character that the encoding lacks is replaced; it must not raise an error.
            stream.reconfigure(errors="replace")
            setattr(sys, name, VisibleText(stream))


@contextmanager
def unchecked_output() -> Iterator[None]:
    """Within this context, printed text may control the terminal: only for texts of the program, such as its help."""
    before = sys.stdout
    before.flush()
    sys.stdout = _unchecked()
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stdout = before


def console(*, stderr: bool = False, **options: Any) -> Console:
    """A Rich console on standard output or standard error."""
    return SafeConsole(file=_unchecked(stderr=stderr), highlight=False, **options)


def is_terminal() -> bool:
    """Whether standard output is a terminal."""
    return _unchecked().isatty()


def print_drawn(text: str) -> None:
    """Print a drawing of livebode that may have colours."""
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
