"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import typer

from livebode.core import UsageError
from livebode.language import available

Band = Annotated[
    str | None,
    typer.Option(metavar="LOW:HIGH", help="Lowest and highest frequency of the modes in Hz, with --output-only."),
]


def parsed_band(text: str) -> list[float]:
    """Both limits in Hz; UsageError if the text has another form.

    >>> parsed_band("20:60")
    [20.0, 60.0]
    """
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise UsageError(
            "unreadable",
            f"the band {text!r} is not LOW:HIGH in Hz",
            "write for example 20:140",
            argument="band",
            value=text,
        ) from None
    return [low, high]


Excitation = Annotated[
    str | None, typer.Option(metavar="CHANNEL", help="Channel of the excitation w, or an expression.")
]
Output = Annotated[
    str | None,
    typer.Option(
        metavar="CHANNEL", help="Channel of the measured output y, or an expression: -y, pos + 0.35*angle, diff(pos)."
    ),
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


def check_use(context: typer.Context, switch: str, own: Collection[str], shared: Collection[str] = ()) -> None:
    """UsageError for a specified option of the other use of a command that an option switches.

    Parameters
    ----------
    context
        Of the command.
    switch
        The option, with its metavar: `--sql QUERY`.
    own
        Options that have a meaning with `switch` only.
    shared
        Options of both uses, beside --json; the others have no meaning with `switch`.
    """
    options = {max(one.opts, key=len): str(one.name) for one in context.command.params}
    sources = {option: context.get_parameter_source(name) for option, name in options.items()}
    given = [option for option, source in sources.items() if source is not None and source.name == "COMMANDLINE"]
    use = switch.split()[0]
    own_given = [option for option in given if option in own]
    other = [option for option in given if option.startswith("--") and option not in (use, *own, *shared, "--json")]
    if use in given and other:
        raise UsageError(
            "conflict", f"{other[0]} and {use} exclude each other", "give one of them", options=[other[0], use]
        )
    if use not in given and own_given:
        raise UsageError(
            "missing", f"{own_given[0]} belongs to {use}", f"give {switch} too", options=[own_given[0], use]
        )


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
