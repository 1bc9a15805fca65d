"""Options by which commands select runs of a lake."""

from __future__ import annotations

from datetime import UTC, datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.trending import Selection


class By(StrEnum):
    """Levels of a machine's name."""

    site = "site"
    line = "line"
    machine = "machine"
    axis = "axis"


Level = Annotated[
    By, typer.Option("--by", help="Level up to which the names of a row are the same.", case_sensitive=False)
]
Below = Annotated[str, typer.Option("--machine", metavar="PATH", help="Only what is below site/line/machine/axis.")]
Since = Annotated[str | None, typer.Option(metavar="DATE", help="First day of the recordings, in UTC: 2025-03-01.")]
Until = Annotated[str | None, typer.Option(metavar="DATE", help="Last day of the recordings, in UTC.")]
CovariateNames = Annotated[
    list[str] | None,
    typer.Option(
        "--covariate",
        metavar="NAME",
        help="Covariate whose influence is removed; repeat for several. \\[default: all that the runs have]",
    ),
]
Recipe = Annotated[
    str | None,
    typer.Option(metavar="ID", help="Begin of the id of the settings. \\[default: the settings of most runs]"),
]
Limit = Annotated[
    float,
    typer.Option(metavar="PERCENT", min=0.1, max=100, help="Change that needs maintenance, for the ranking."),
]


def selection(
    by: By, below: str, since: str | None, until: str | None, covariates: list[str] | None, recipe: str | None
) -> Selection:
    """The runs that the options select; UsageError if a date is not one."""
    from datetime import timedelta

    from livebode.trending import Selection

    last = day(until, "--until")
    return Selection(
        by.value,
        below.strip("/"),
        day(since, "--since"),
        last and last + timedelta(days=1),
        covariates or None,
        recipe,
    )


def day(text: str | None, option: str) -> datetime | None:
    """The begin of a day in UTC; UsageError if it is not a date."""
    if text is None:
        return None
    try:
        return datetime.strptime(text, "%Y-%m-%d").replace(tzinfo=UTC)
    except ValueError:
        raise UsageError(
            "unreadable",
            f"{option}={text!r} is not a date",
            "write it as 2025-03-01",
            argument=option,
            value=text,
        ) from None
