"""Output to the terminal: text from files, sources and users cannot control it.

Control characters in printed text are made visible. Only Rich and the plot write colours and cursor movements.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TextIO, cast

from livebode.cli.frames import has_colours, printable, terminal_width, visible

if TYPE_CHECKING:
    from rich.console import Console


_COLOUR = re.compile("(\x1b\\[[0-9;]*m)")


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


prints_percent = False
"""Whether a run prints how far it is as lines, where there is no terminal for a bar."""


def print_percent() -> None:
    """Print from now on how far a run is as lines, "livebode: 42 % of 80000 samples": for a program that reads them."""
    global prints_percent
    prints_percent = True


def protect() -> None:
    """Make standard output and standard error print control characters as escapes."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and not isinstance(stream, VisibleText):
            # A character that the encoding lacks is replaced; it must not raise an error.
            stream.reconfigure(errors="replace")
            setattr(sys, name, VisibleText(stream))


def console(*, stderr: bool = False, **options: Any) -> Console:
    """A Rich console on standard output or standard error."""
    from livebode.cli.safe_console import SafeConsole  # with Rich, which a completion does without

    return SafeConsole(file=_unchecked(stderr=stderr), highlight=False, **options)


def print_page(page: Callable[[int, bool], str], *, stderr: bool = False) -> None:
    """Print a text of the program, such as its help, for the width of the stream and with or without colours."""
    stream = _unchecked(stderr=stderr)
    print(printable(page(terminal_width(stream), has_colours(stream)), stream), file=stream, flush=True)


def is_terminal(*, stderr: bool = False) -> bool:
    """Whether standard output, or standard error, is a terminal."""
    return _unchecked(stderr=stderr).isatty()


def print_drawn(text: str) -> None:
    """Print a drawing of livebode that may have colours."""
    sys.stdout.flush()
    parts = _COLOUR.split(text)  # every second one is a colour
    parts[::2] = map(visible, parts[::2])
    print("".join(parts), file=_unchecked(), flush=True)


def _unchecked(*, stderr: bool = False) -> TextIO:
    stream = sys.stderr if stderr else sys.stdout
    return stream.unchecked if isinstance(stream, VisibleText) else cast("TextIO", stream)
