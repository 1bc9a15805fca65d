"""`livebode export`: write a run in a format of other programs, or the rows of a query."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.next_step import NextCommand
from livebode.cli.options import Entry, Json
from livebode.cli.query_result import Csv, RowsMax, check_query, print_result
from livebode.cli.remote import beside
from livebode.core import UsageError, counted
from livebode.estimates import kind_of, rule
from livebode.locations import location
from livebode.plugins import loaded, named

if TYPE_CHECKING:
    from livebode.core import MatrixResponses, Responses
    from livebode.records import RunRecord

_IN_PYTHON = {
    "xarray": "livebode.Run(path).responses.to_xarray(), or .matrix.to_xarray() of a matrix run; "
    "--to netcdf writes a file that xarray opens",
    "control": "livebode.Run(path).average.to_frd(), or .matrix.to_frd() of a matrix run",
}


def export_command(
    context: typer.Context,
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.", parser=location)],
    to: Annotated[
        str | None,
        typer.Option(metavar="FORMAT", help="Format: csv, mat, netcdf or uff; of --lpv json, mat, netcdf or c."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File to write. \\[default: RUN with the format's suffix]")
    ] = None,
    at: Annotated[float | None, typer.Option(metavar="SECONDS", help="Only the response nearest to this time.")] = None,
    mean: Annotated[
        bool, typer.Option("--mean", help="Only the mean of the valid responses; the newest of a matrix run.")
    ] = False,
    parameters: Annotated[
        bool, typer.Option("--parameters", help="Fitted parameters instead of responses; csv or mat.")
    ] = False,
    lpv: Annotated[
        bool, typer.Option("--lpv", help="The model over the schedule, with covariance: two masses fitted at places.")
    ] = False,
    entry: Entry = None,
    sql: Annotated[
        str | None,
        typer.Option(
            metavar="QUERY",
            help="Print the rows of an SQL query (DuckDB) instead; tables: responses, parameters, samples, events.",
        ),
    ] = None,
    rows: RowsMax = 1000,
    as_csv: Csv = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Write the responses, the fitted parameters or the model in a format of other programs, or query with SQL.

    Of a matrix run all entries are written, or one of them with --entry, as of an ordinary run. A query may be of a run
    that is still recording, and has no access to files. DuckDB, pandas and Polars can also read the Parquet files
    directly. `livebode archive list --sql` is the same for all runs of a lake.
    """
    check_query(context, as_csv=as_csv, as_json=as_json)
    if sql is not None:
        _print_rows(run, sql, rows, as_csv=as_csv, as_json=as_json)
        return None
    if to is None:
        raise UsageError(
            "missing",
            "the format is not named",
            "give --to FORMAT, or --sql QUERY to print rows",
            options=["--to", "--sql"],
        )
    from livebode import export
    from livebode.records import RunRecord, to_json

    chosen = {"--at": at is not None, "--mean": mean, "--parameters": parameters, "--lpv": lpv}
    formats = export.writers("model" if lpv else "parameters" if parameters else "responses")
    chosen["--entry"] = lpv and entry is not None
    _check(to, chosen, tuple(formats))
    record = RunRecord.open(run, output_only=parameters, matrix=not lpv, entry=entry)
    name = beside(record.path)
    path = out or name.with_name(name.name + "-parameters" * parameters + "-lpv" * lpv + named("exports")[to].ending)
    if parameters:
        table = export.ParameterTable(record.path, lambda: record.undamaged(record.tables("parameters"), "parameters"))
        written = export.save(path, lambda path: loaded(formats[to])(path, table), force=force)
        found = {"file": str(path), "rows": written.rows}
        print(to_json(found) if as_json else f"{path}: {written.rows} parameter values")
        return NextCommand("report", run)
    if lpv:
        from livebode.analysis import lpv_model

        model = lpv_model(run)
        written = export.save(path, lambda path: loaded(formats[to])(path, model), force=force)
        print(to_json({"file": str(path), "rows": written.rows}) if as_json else f"{path}: {written.rows} places")
        return NextCommand("report", run)
    export_rule = rule(kind_of(record.summary), "export")
    parts = export_rule(record, at, mean)
    formats = export.writers(export_rule.__name__)
    _check(to, chosen, tuple(formats))
    written = export.save(path, lambda path: loaded(formats[to])(path, parts, record.summary), force=force)
    if as_json:
        print(to_json({"file": str(path), "rows": written.rows, "left_out": written.left_out}))
        return None
    left_out = f"; {written.left_out} with fewer than two valid lines left out" if written.left_out else ""
    print(f"{path}: {counted(written.rows)} at {counted(len(record.lines), 'line')}{left_out}")
    return NextCommand("report", run, entry=entry)


def _print_rows(run: Path, sql: str, rows_max: int, *, as_csv: bool, as_json: bool) -> None:
    from livebode.records import (
        RunRecord,
        query,  # with Arrow's data sets
    )

    found = query(RunRecord.open(run, output_only=True, matrix=True), sql, rows_max)
    print_result(found, rows_max, as_csv=as_csv, as_json=as_json)


def responses(record: RunRecord, at: float | None, mean: bool) -> Iterator[Responses]:
    """All responses, the one nearest to a time, or their mean."""
    from livebode import export
    from livebode.core import Responses

    if at is not None:
        return iter([Responses.of(export.nearest_response(record.undamaged(record.batches()), at))])
    if mean:
        from livebode.analysis import mean_of

        return iter([mean_of(record)])
    return record.undamaged(record.batches())


def matrices(record: RunRecord, at: float | None, newest: bool) -> Iterator[MatrixResponses]:
    """All matrices, or the newest; UsageError for one at a time, as each is from several experiments."""
    if at is not None:
        raise UsageError(
            "conflict",
            f"{record.place!r} is a matrix run, and each matrix is from several experiments, so --at has no meaning",
            "use --mean for the newest matrix, or select one entry with --entry",
            options=["--at"],
        )
    return iter([record.matrix().newest()]) if newest else record.undamaged(record.matrix_batches())


def _check(to: str, chosen: dict[str, bool], formats: tuple[str, ...]) -> None:
    if to in _IN_PYTHON:
        raise UsageError(
            "not-one-of",
            f"{to} is not a file format",
            f"in Python use {_IN_PYTHON[to]} (docs/how-to/export.md)",
            argument="to",
            value=to,
            allowed=list(formats),
        )
    if to not in formats:
        what = "the model" if chosen["--lpv"] else "parameters" if chosen["--parameters"] else "responses"
        raise UsageError(
            "not-one-of",
            f"{to!r} is not a format for {what}",
            f"choose {', '.join(formats[:-1])} or {formats[-1]}",
            argument="to",
            value=to,
            allowed=list(formats),
        )
    given = [name for name, used in chosen.items() if used]
    if len(given) > 1:
        raise UsageError(
            "conflict", f"{given[0]} and {given[1]} exclude each other", "give one of them", options=given[:2]
        )
