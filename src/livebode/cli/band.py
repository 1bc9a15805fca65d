"""A band of frequencies as an option."""

from __future__ import annotations

from typing import Annotated

import typer

from livebode.core import UsageError

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
