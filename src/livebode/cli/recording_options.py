"""Options about a recording that several commands share, with the descriptions of the keys of [source]."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.section_options import key_help

Rate = Annotated[float | None, typer.Option(metavar="HZ", help=key_help("source.rate_hz"))]
Time = Annotated[str | None, typer.Option(metavar="COLUMN", help=key_help("source.time"))]
From = Annotated[str | None, typer.Option("--from", metavar="MOMENT", help=key_help("source.from"))]
To = Annotated[str | None, typer.Option("--to", metavar="MOMENT", help=key_help("source.to"))]
SkipPeriods = Annotated[int | None, typer.Option(metavar="N", help=key_help("source.skip_periods"))]
Dbc = Annotated[Path | None, typer.Option(metavar="FILE", help=key_help("source.dbc"))]
