"""`livebode view`: a run in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Port
from livebode.cli.serving import dashboard_of, tell, wait_for_the_end
from livebode.session import Axis
from livebode.session.axis import ServeSection


def view_command(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Directories that runs left, or are leaving.")],
    port: Port = None,
    axis: Annotated[
        Path | None, typer.Option(metavar="AXIS.toml", help="Takes \\[serve] from there: address, tokens, TLS.")
    ] = None,
) -> None:
    """Show runs in a browser as `livebode run --serve` does, until Ctrl-C; one that is being recorded is followed."""
    dashboard = dashboard_of(ServeSection() if axis is None else Axis.read(axis).serve, port)
    for run in runs:
        dashboard.view(run)
    with dashboard:
        tell(f"the dashboard is at {dashboard.url}")
        wait_for_the_end()
