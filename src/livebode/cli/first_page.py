"""The first page of help, `livebode --help`, in the frames that Rich draws around the help of a command."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping

from livebode.cli.commands import SUMMARIES

ABOUT = "The Bode plot of a machine while the machine works."
OPTIONS: Mapping[str, str] = {
    "--version": "Print the version and exit.",
    "--log-level LEVEL": "Write a log from this level on: debug, info, warning or error. [default: info with "
    "--log-file]",
    "--log-file FILE": "Write the log there instead of on standard error.",
    "--install-completion": "Install completion for the current shell.",
    "--show-completion": "Show completion for the current shell, to copy it or customize the installation.",
    "--help -h": "Show this message and exit.",
}
_MINIMUM_WIDTH = 40
_BOLD, _DIM, _YELLOW, _CYAN, _END = "\x1b[1m", "\x1b[2m", "\x1b[1;33m", "\x1b[1;36m", "\x1b[0m"


def first_page(width: int, *, colours: bool) -> str:
    """Usage, options and commands, for a terminal of `width` columns.

    >>> print(first_page(60, colours=False).strip().splitlines()[0])
    Usage: livebode [OPTIONS] COMMAND [ARGS]...
    """
    width = max(width, _MINIMUM_WIDTH)
    usage = [("Usage: ", _YELLOW), ("livebode [OPTIONS] COMMAND [ARGS]...", _BOLD)]
    lines = [
        "",
        " " + "".join(_styled(text, style, colours=colours) for text, style in usage),
        "",
        *textwrap.wrap(ABOUT, width, initial_indent=" ", subsequent_indent=" "),
        "",
        *_panel("Options", OPTIONS, width, colours=colours),
        *_panel("Commands", SUMMARIES, width, colours=colours),
        "",
    ]
    return "\n".join(lines) + "\n"


def _panel(title: str, rows: Mapping[str, str], width: int, *, colours: bool) -> Iterator[str]:
    side = _styled("│", _DIM, colours=colours)
    names = max(map(len, rows))
    texts = width - names - 6
    yield _styled(f"╭─ {title} {'─' * (width - len(title) - 5)}╮", _DIM, colours=colours)
    for name, text in rows.items():
        first = _styled(f"{name:{names}}", _CYAN, colours=colours)
        for line in textwrap.wrap(text, texts, break_on_hyphens=False):
            yield f"{side} {first}  {line:{texts}} {side}"
            first = " " * names
    yield _styled(f"╰{'─' * (width - 2)}╯", _DIM, colours=colours)


def _styled(text: str, style: str, *, colours: bool) -> str:
    return f"{style}{text}{_END}" if colours else text
