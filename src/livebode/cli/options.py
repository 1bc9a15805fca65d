"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.core import UsageError
from livebode.language import available

Excitation = Annotated[
    str | None, typer.Option(metavar="CHANNEL", help="Channel of the excitation w, or an expression.")
]
Output = Annotated[
    str | None,
    typer.Option(
        metavar="CHANNEL", help="Channel of the measured output y, or an expression: -y, pos + 0.35*angle, diff(pos)."
    ),
]
Outputs = Annotated[
    list[str] | None,
    typer.Option(
        "--output",
        metavar="CHANNEL",
        help="Channel of the measured output y, or an expression: -y, pos + 0.35*angle, diff(pos); repeat for several.",
    ),
]
Rate = Annotated[float | None, typer.Option(metavar="HZ", help="Sample rate, if the recording does not contain it.")]
Time = Annotated[
    str | None,
    typer.Option(
        metavar="COLUMN",
        help="Time column, if it is not detected by its name; unit in brackets behind the name. none: no time column.",
    ),
]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="MOMENT",
        help="Beginning of the part to use: seconds in the time of the recording, '5000 samples' or '3 periods'.",
    ),
]
To = Annotated[str | None, typer.Option("--to", metavar="MOMENT", help="End of the part to use, in the same form.")]
SkipPeriods = Annotated[
    int | None,
    typer.Option(metavar="N", min=0, help="Leave out N periods at the beginning of the excitation."),
]
Dbc = Annotated[
    Path | None, typer.Option(metavar="FILE", help="DBC file that defines the signals of a recording of CAN frames.")
]
Entry = Annotated[
    str | None,
    typer.Option(metavar="OUTPUT/INPUT", help="Entry of a matrix run, such as velocity2/u1."),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result, or the error, as JSON.")]
Port = Annotated[
    int | None,
    typer.Option(metavar="PORT", min=0, max=65535, help="Port of the dashboard; 0: any free port. \\[default: 8765]"),
]
ServeFile = Annotated[
    Path | None,
    typer.Option(
        "--axis",
        metavar="AXIS.toml",
        help="Read \\[serve] from this file, which may have nothing else: address, tokens, TLS.",
    ),
]
Serve = Annotated[bool, typer.Option("--serve", help="Show the run in a browser while it is recorded.")]


def known_language(code: str | None) -> str | None:
    """The code of a language; UsageError for another one."""
    if code is not None and code not in available():
        raise UsageError(
            "not-one-of",
            f"--language={code!r} is not one of the languages",
            f"choose {', '.join(available())}",
            argument="--language",
            value=code,
            allowed=list(available()),
        )
    return code


ReportLanguage = Annotated[
    str | None,
    typer.Option(
        "--language", metavar="CODE", callback=known_language,
        help=f"Language of the document: {', '.join(available())}. Terminal and JSON output are English. "
        "\\[default: that of the \\[report], or en]",
    ),
]  # fmt: skip
