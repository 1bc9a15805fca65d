"""`livebode query`: run an SQL query on the tables of a run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli import terminal
from livebode.cli.options import Json
from livebode.core import UsageError
from livebode.locations import location


def query_command(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Run directory; also of a run that is still recording.", parser=location),
    ],
    sql: Annotated[str, typer.Argument(help="SQL query on the tables responses, parameters, samples and events.")],
    rows: Annotated[int, typer.Option(min=1, max=10_000_000, help="Maximum number of rows to print.")] = 1000,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print the result as CSV.")] = False,
    as_json: Json = False,
) -> None:
    """Query the tables of a run with SQL (DuckDB).

    A query has no access to files. DuckDB, pandas and Polars can also read the Parquet files directly.
    """
    import csv

    from livebode.records import RunRecord, to_json
    from livebode.records.query import query  # with Arrow's data sets

    if as_csv and as_json:
        raise UsageError(
            "conflict",
            "--csv and --json are two forms of the same result",
            "give one of them",
            options=["--csv", "--json"],
        )
    found = query(RunRecord.open(run, output_only=True, matrix=True), sql, rows)
    if as_json:
        plain = [[_plain(value) for value in row] for row in found.rows]
        print(to_json({"columns": found.columns, "rows": plain, "more": found.more}))
    elif as_csv:
        csv.writer(sys.stdout, lineterminator="\n").writerows([found.columns, *found.rows])
    else:
        _show(found.columns, found.rows)
    if found.more:
        print(f"livebode: only the first {rows} rows; give --rows for more", file=sys.stderr)


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
