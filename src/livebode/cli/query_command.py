"""`livebode query`: run an SQL query on the tables of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Json
from livebode.cli.query_result import Csv, RowsMax, check_form, print_result
from livebode.locations import location


def query_command(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Run directory; also of a run that is still recording.", parser=location),
    ],
    sql: Annotated[str, typer.Argument(help="SQL query on the tables responses, parameters, samples and events.")],
    rows: RowsMax = 1000,
    as_csv: Csv = False,
    as_json: Json = False,
) -> None:
    """Query the tables of a run with SQL (DuckDB).

    A query has no access to files. DuckDB, pandas and Polars can also read the Parquet files directly.
    `livebode archive query` is the same for all runs of a lake.
    """
    from livebode.records import (
        RunRecord,
        query,  # with Arrow's data sets
    )

    check_form(as_csv=as_csv, as_json=as_json)
    found = query(RunRecord.open(run, output_only=True, matrix=True), sql, rows)
    print_result(found, rows, as_csv=as_csv, as_json=as_json)
