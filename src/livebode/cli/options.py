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
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")]
