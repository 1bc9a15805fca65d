"""`livebode view`: show runs in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Port, ServeFile
from livebode.locations import location


def view_command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run directories, also of runs that are still recording; or one directory that contains runs.",
            parser=location,
        ),
    ],
    port: Port = None,
    axis: ServeFile = None,
) -> None:
    """Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still recording.

    Of a directory that contains runs, show a list of them, to search, tag, compare and delete, and their trends.
    """
    from livebode.cli.serving import dashboard_of, print_line, wait_for_the_end
    from livebode.configuration import ServeSection, read_serve_section
    from livebode.records import is_run

    dashboard = dashboard_of(ServeSection() if axis is None else read_serve_section(axis), port)
    if len(runs) == 1 and runs[0].is_dir() and not is_run(runs[0]):
        dashboard.view_all(runs[0])
    else:
        for run in runs:
            dashboard.view(run)
    with dashboard:
        print_line(f"the dashboard is at {dashboard.url}")
        wait_for_the_end()
