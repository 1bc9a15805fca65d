"""The argument and the options by which the subcommands of `livebode archive` select a lake and its runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import console, is_terminal
from livebode.core import UsageError
from livebode.dataclass import dataclass

if TYPE_CHECKING:
    from livebode_plant.trending import Selection

LakeOf = Annotated[str, typer.Argument(metavar="ARCHIVE", help="archive.toml, or the directory or URL of its lake.")]


class By(StrEnum):
    """Levels of a machine's name."""

    site = "site"
    line = "line"
    machine = "machine"
    axis = "axis"


Level = Annotated[
    By | None,
    typer.Option(
        "--by", help="Level up to which the names of a row are the same. \\[default: machine]", case_sensitive=False
    ),
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


_OPTIONS: Mapping[str, tuple[Any, Any]] = {
    "by": (Level, None),
    "below": (Below, ""),
    "since": (Since, None),
    "until": (Until, None),
    "covariate": (CovariateNames, None),
    "recipe": (Recipe, None),
}


@dataclass(frozen=True)
class SelectionOptions:
    """What was given; a command without an option has its default here."""

    by: By | None = None
    below: str = ""
    since: str | None = None
    until: str | None = None
    covariate: list[str] | None = None
    recipe: str | None = None

    def selection(self, by: By = By.axis) -> Selection:
        """The runs that the options select, by this level if none is given; UsageError if a date is not one."""
        from livebode_plant.trending import Selection

        last = day(self.until, "--until")
        return Selection(
            (self.by or by).value,
            self.below.strip("/"),
            day(self.since, "--since"),
            last and last + timedelta(days=1),
            self.covariate or None,
            self.recipe,
        )


def with_selection(*names: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A command with these options in place of its parameter `chosen`, which receives them as SelectionOptions."""

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def selecting(**given: Any) -> Any:
            return command(chosen=SelectionOptions(**{name: given.pop(name) for name in names}), **given)

        kind = inspect.Parameter.KEYWORD_ONLY
        parameters: list[inspect.Parameter] = []
        signature = inspect.signature(command, eval_str=True)
        for name, parameter in signature.parameters.items():
            if name == "chosen":
                options = ((name, *_OPTIONS[name]) for name in names)
                parameters += [inspect.Parameter(name, kind, default=d, annotation=of) for name, of, d in options]
            else:
                parameters.append(parameter.replace(kind=kind))
        selecting.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        selecting.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return selecting

    return decorated


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


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[str] = ()) -> None:
    """Print a table whose columns in `right` are numbers; in full width where the output is not a terminal."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold", justify="right" if column in right else "left")
    for row in rows:
        table.add_row(*row)
    console(width=None if is_terminal() else 1 << 14, markup=False).print(table)
