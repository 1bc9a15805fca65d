"""`livebode archive list`: the runs of a lake by machine, and the recordings in quarantine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Csv, Json, NextCommand, RowsMax, check_query, print_result
from livebode_plant.cli.archive.selection import LakeOf, print_table

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
) -> NextCommand | None:
    """List the runs of a lake by machine, and the recordings in quarantine; with --sql, query its tables.

    A query has no access to files, and does not see results that are not complete.
    """
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.archive.contents import machines, quarantine
    from livebode_plant.lake import Lake

    check_query(context, as_csv=as_csv, as_json=as_json)
    lake = Lake(lake_url(archive))
    is_configuration = archive.lower().endswith(".toml")
    if sql is not None:
        from livebode_plant.lake.query import query_lake

        print_result(query_lake(lake, sql, rows), rows, as_csv=as_csv, as_json=as_json)
        return None
    if quarantined:
        bad = quarantine(lake)
        if as_json:
            print(to_json({"quarantine": bad}))
        elif bad:
            print_table(("recording", "code", "reason"), [(row["url"], row["code"], row["sentence"]) for row in bad])
        else:
            print("no recording is in quarantine")
        return NextCommand("archive", "run", archive, retry="all") if bad and is_configuration else None
    rows_of_machines = [row.plain for row in machines(lake)]
    if as_json:
        print(to_json({"machines": rows_of_machines}))
    elif rows_of_machines:
        words = [["" if value is None else str(value) for value in row.values()] for row in rows_of_machines]
        print_table(_COLUMNS, words, _COLUMNS[1:5])
        return None if Path("hall-report.html").exists() else NextCommand("archive", "trend", archive)
    else:
        print(f"the lake {lake.url} has no run yet")
        return NextCommand("archive", "run", archive) if is_configuration else None
    return None
