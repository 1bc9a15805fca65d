"""The first page of help, `livebode --help`."""

from __future__ import annotations

from livebode.cli.commands import ABOUT, OPTIONS, panels
from livebode.cli.frames import MINIMUM_WIDTH, paragraph, table, usage
from livebode.plugins import named


def first_page(width: int, *, colours: bool) -> str:
    """Usage, options and commands, for a terminal of `width` columns.

    >>> print(first_page(60, colours=False).strip().splitlines()[0])
    Usage: livebode [OPTIONS] COMMAND [ARGS]...
    """
    width = max(width, MINIMUM_WIDTH)
    by_panel = panels(named("commands")).items()
    commands = [line for title, rows in by_panel for line in table(title, rows, width, colours=colours)]
    lines = [
        "",
        usage("livebode [OPTIONS] COMMAND [ARGS]...", colours=colours),
        "",
        *paragraph(ABOUT, width),
        "",
        *table("Options", OPTIONS.items(), width, colours=colours),
        *commands,
        "",
    ]
    return "\n".join(lines) + "\n"
