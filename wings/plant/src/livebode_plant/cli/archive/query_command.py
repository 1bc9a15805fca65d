"""`livebode archive query`: run an SQL query on the tables of a lake."""

from __future__ import annotations

from typing import Annotated

import typer

from livebode.cli import Csv, Json, RowsMax, check_form, print_result
from livebode_plant.cli.archive.options import LakeOf


def query_command(
    archive: LakeOf,
    sql: Annotated[
        str, typer.Argument(help="SQL query on the tables runs, quantities, responses, covariance, parameters, events…")
    ],
    rows: RowsMax = 1000,
    as_csv: Csv = False,
    as_json: Json = False,
) -> None:
    """Query the tables of a lake with SQL (DuckDB).

    A query has no access to files, and does not see results that are not complete.
    """
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake
    from livebode_plant.lake.query import query_lake

    check_form(as_csv=as_csv, as_json=as_json)
    print_result(query_lake(Lake(lake_url(archive)), sql, rows), rows, as_csv=as_csv, as_json=as_json)
