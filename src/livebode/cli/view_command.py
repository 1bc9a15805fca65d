"""`livebode view`: show runs in the browser."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.options import Port, ServeFile
from livebode.cli.terminal import is_terminal
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.dashboard import Dashboard

_DISPLAYS = "DISPLAY", "WAYLAND_DISPLAY"


def view_command(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RUN...",
            help="Run directories, also of runs that are still recording; or one directory of runs, which may be empty "
            "or missing. \\[default: runs]",
            parser=location,
        ),
    ] = None,
    port: Port = None,
    axis: ServeFile = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Do not open the page in the browser, as without a screen.")
    ] = False,
) -> None:
    """Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still recording.

    Of a directory of runs, show a list of them, to search, tag, compare and delete, and their trends; drop a recording
    there to measure it. `livebode` alone shows the directory `runs`.
    """
    from livebode.cli.serving import dashboard_of, print_line, wait_for_the_end
    from livebode.configuration import ServeSection, read_serve_section
    from livebode.core import ServerError
    from livebode.records import is_run

    shown = runs or [Path("runs")]
    section = ServeSection() if axis is None else read_serve_section(axis)

    def showing(port: int | None) -> Dashboard:
        dashboard = dashboard_of(section, port)
        if len(shown) == 1 and not is_run(shown[0]) and (shown[0].is_dir() or _is_new(shown[0])):
            dashboard.view_all(shown[0])
        else:
            for run in shown:
                dashboard.view(run)
        return dashboard

    with ExitStack() as stack:
        try:
            dashboard = stack.enter_context(showing(port))
        except ServerError as error:  # the page of another directory has the usual port
            if port is not None or axis is not None or error.code != "server.port-taken":
                raise
            dashboard = stack.enter_context(showing(0))
        print_line(f"the dashboard is at {dashboard.url}")
        if not no_browser and _has_screen():
            import webbrowser

            webbrowser.open(dashboard.url)
        wait_for_the_end()


def _is_new(directory: Path) -> bool:
    """Whether it could be made for runs; a missing one beside runs, or in nothing, is a name that is wrong."""
    from livebode.records import is_run

    if os.path.lexists(directory) or not directory.parent.is_dir():
        return False
    return not any(is_run(path) for path in directory.parent.iterdir())


def _has_screen() -> bool:
    """Whether a person is at this computer, and a browser would not open in the terminal."""
    if not is_terminal(stderr=True):
        return False
    local = "SSH_CONNECTION" not in os.environ
    return local if os.name == "nt" or sys.platform == "darwin" else any(os.environ.get(name) for name in _DISPLAYS)
