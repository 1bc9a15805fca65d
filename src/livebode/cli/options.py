"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

Excitation = Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the excitation w.")]
Output = Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the measured output y.")]
Rate = Annotated[
    float | None, typer.Option(metavar="HZ", help="Samples per second, where the recording does not say it.")
]
Time = Annotated[
    str | None,
    typer.Option(
        metavar="COLUMN",
        help="Time column where its name does not tell, with its unit in brackets behind it; none ignores it.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, and an error too.")]
Port = Annotated[
    int | None,
    typer.Option(metavar="PORT", min=0, max=65535, help="Of the dashboard; 8765 unless said, 0 for a free one."),
]
Serve = Annotated[bool, typer.Option("--serve", help="Show the run in a browser while it goes on.")]
