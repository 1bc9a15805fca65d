"""The result of a query, printed as a table, as CSV or as JSON."""

from __future__ import annotations

import csv
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import terminal
from livebode.cli.options import check_use
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.records import QueryResult

RowsMax = Annotated[
    int, typer.Option("--rows", min=1, max=10_000_000, help="Maximum number of rows of --sql to print.")
]
Csv = Annotated[bool, typer.Option("--csv", help="Print the rows of --sql as CSV.")]


def check_query(context: typer.Context, *, as_csv: bool, as_json: bool) -> None:
    """UsageError if a query has two forms or another option of the command, or its options have no query."""
    check_use(context, "--sql QUERY", ("--rows", "--csv"))
    if as_csv and as_json:
        raise UsageError(
            "conflict",
            "--csv and --json are two forms of the same result",
            "give one of them",
            options=["--csv", "--json"],
        )


def print_result(found: QueryResult, rows_max: int, *, as_csv: bool, as_json: bool) -> None:
    """Print the rows, and a remark where there are more."""
    from livebode.records import to_json

    if as_json:
        plain = [[_plain(value) for value in row] for row in found.rows]
        print(to_json({"columns": found.columns, "rows": plain, "more": found.more}))
    elif as_csv:
        csv.writer(sys.stdout, lineterminator="\n").writerows([found.columns, *found.rows])
    else:
        _show(found.columns, found.rows)
    if found.more:
        print(f"livebode: only the first {rows_max} rows; give --rows for more", file=sys.stderr)


def _show(columns: tuple[str, ...], rows: list[tuple[Any, ...]]) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*(f"{value:.9g}" if isinstance(value, float) else str(value) for value in row))
    # A file or a pipe does not limit the width.
    terminal.console(width=None if terminal.is_terminal() else 1 << 14, markup=False).print(table)


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float | bool | None) else str(value)
