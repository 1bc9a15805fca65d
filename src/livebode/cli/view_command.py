"""`livebode view`: show runs in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Port
from livebode.cli.serving import dashboard_of, print_line, wait_for_the_end
from livebode.configuration import Axis
from livebode.configuration.axis import ServeSection


def view_command(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run directories; also of runs that are still recording.")
    ],
    port: Port = None,
    axis: Annotated[
        Path | None, typer.Option(metavar="AXIS.toml", help="Read \\[serve] from this file: address, tokens, TLS.")
    ] = None,
) -> None:
    """Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still recording."""
    dashboard = dashboard_of(ServeSection() if axis is None else Axis.read(axis).serve, port)
    for run in runs:
        dashboard.view(run)
    with dashboard:
        print_line(f"the dashboard is at {dashboard.url}")
        wait_for_the_end()
