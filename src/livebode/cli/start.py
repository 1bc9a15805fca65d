"""The entry point: version and first page of help at once, everything else by the application.

Without words a person at a terminal gets the start page in the browser, and a script the help.

Typer and Rich alone take ten times as long to load as Python takes to start.
"""

from __future__ import annotations

import atexit
import gc
import os
import sys
import warnings

from livebode.version import __version__

_USAGE_ERROR, _INTERRUPTED = 2, 130
_COMPLETION = "_LIVEBODE_COMPLETE"
"""The variable with which a shell asks for completions; the command line is then empty."""
OBJECTS_NEW = 100_000
"""New objects of Python after which cycles without a reference are searched: what a command loads remains until its
end, and searching it again and again, for the last time at exit, takes a twentieth of the run of a recording."""


def main() -> None:
    """Run the command line and exit with its code."""
    words = sys.argv[1:]
    if words == ["--version"] and _printed(f"livebode {__version__}\n"):
        return
    if words in (["--help"], ["-h"]) and _printed(_help()):
        return
    if words in ([], ["--no-browser"]) and _COMPLETION not in os.environ:
        if words or _has_start_page():
            sys.argv.insert(1, "view")
        elif _printed(_help()):
            sys.exit(_USAGE_ERROR)
    gc.set_threshold(OBJECTS_NEW)
    atexit.register(_leave_cycles)
    try:
        from livebode.cli.app import run_application
    except KeyboardInterrupt:
        print("livebode: stopped; nothing was written", file=sys.stderr)
        sys.exit(_INTERRUPTED)
    run_application()


def _has_start_page() -> bool:
    """Whether somebody is at a terminal, and what serves and shows the page is installed."""
    if not sys.stdout.isatty():
        return False
    from importlib.util import find_spec

    from livebode.plugins import plugins

    return bool(plugins("workspaces")) and all(find_spec(name) for name in ("starlette", "uvicorn", "websockets"))


def _help() -> str:
    from livebode.cli.first_page import first_page  # with the commands of plug-ins
    from livebode.cli.frames import has_colours, terminal_width

    with warnings.catch_warnings(record=True) as problems:
        page = first_page(terminal_width(sys.stdout), colours=has_colours(sys.stdout))
    for problem in problems:  # a plug-in that cannot be loaded
        print(f"livebode: {problem.message}", file=sys.stderr)
    return page


def _printed(text: str) -> bool:
    # What cannot be printed is left to the application: it reports a full disk, and its frames need no Unicode.
    try:
        print(text, end="", flush=True)
    except (OSError, UnicodeError):
        return False
    return True


def _leave_cycles() -> None:
    """Exit without a last search for cycles, unless DuckDB was used: it complains about what is left."""
    if "duckdb" not in sys.modules:
        gc.freeze()
