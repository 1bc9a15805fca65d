"""`livebode archive list`: the runs of a lake by machine, and the recordings in quarantine."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from livebode.cli import Csv, Json, RowsMax, check_query, console, is_terminal, print_result
from livebode_plant.cli.archive.selection import LakeOf

_COLUMNS = ("machine", "runs", "judged", "alarming", "quarantined", "first", "last")


def list_command(
    context: typer.Context,
    archive: LakeOf,
    quarantined: Annotated[
        bool, typer.Option("--quarantined", help="List the recordings in quarantine, with the reason of each.")
    ] = False,
    sql: Annotated[
        str | None,
        typer.Option(
            metavar="QUERY",
            help="Print the rows of an SQL query (DuckDB) instead; tables: runs, quantities, responses, covariance, "
            "parameters, events…",
        ),
    ] = None,
    rows: RowsMax = 1000,
    as_csv: Csv = False,
    as_json: Json = False,
) -> None:
    """List the runs of a lake by machine, and the recordings in quarantine; with --sql, query its tables.

    A query has no access to files, and does not see results that are not complete.
    """
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.archive.contents import machines, quarantine
    from livebode_plant.lake import Lake

    check_query(context, as_csv=as_csv, as_json=as_json)
    lake = Lake(lake_url(archive))
    if sql is not None:
        from livebode_plant.lake.query import query_lake

        print_result(query_lake(lake, sql, rows), rows, as_csv=as_csv, as_json=as_json)
        return
    if quarantined:
        bad = quarantine(lake)
        if as_json:
            print(to_json({"quarantine": bad}))
        elif bad:
            _print(("recording", "code", "reason"), [(one["url"], one["code"], one["sentence"]) for one in bad])
        else:
            print("no recording is in quarantine")
        return
    found = [one.plain for one in machines(lake)]
    if as_json:
        print(to_json({"machines": found}))
    elif found:
        _print(_COLUMNS, [tuple(row.values()) for row in found])
    else:
        print(f"the lake {lake.url} has no run yet")


def _print(columns: tuple[str, ...], rows: list[tuple[Any, ...]]) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold", justify="right" if column in _COLUMNS[1:5] else "left")
    for row in rows:
        table.add_row(*("" if value is None else str(value) for value in row))
    console(width=None if is_terminal() else 1 << 14, markup=False).print(table)
