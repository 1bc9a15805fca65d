"""`livebode export`: write a run in a format of other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.options import Entry, Json
from livebode.cli.remote import beside
from livebode.core import UsageError, counted
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.export import WriteResult
    from livebode.records import RunRecord

_IN_PYTHON = {
    "xarray": "livebode.Run(path).responses.to_xarray(), or .matrix.to_xarray() of a matrix run; "
    "--to netcdf writes a file that xarray opens",
    "control": "livebode.Run(path).average.to_frd(), or .matrix.to_frd() of a matrix run",
}


def export_command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.", parser=location)],
    to: Annotated[
        str, typer.Option(metavar="FORMAT", help="Format: csv, mat, netcdf or uff; of --lpv json, mat, netcdf or c.")
    ],
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
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: Json = False,
) -> None:
    """Write the responses, the fitted parameters or the model over the position in a format of other programs.

    Of a matrix run all entries are written, or one of them with --entry, as of an ordinary run.
    """
    from livebode import export
    from livebode.records import RunRecord, to_json

    formats = export.MODELS if lpv else export.TABLES if parameters else export.FORMATS
    chosen = {"--at": at is not None, "--mean": mean, "--parameters": parameters, "--lpv": lpv}
    chosen["--entry"] = lpv and entry is not None
    _check(to, chosen, tuple(formats))
    record = RunRecord.open(run, output_only=parameters, matrix=not lpv, entry=entry)
    name = beside(record.path)
    path = out or name.with_name(name.name + "-parameters" * parameters + "-lpv" * lpv + export.ENDINGS[to])
    if parameters:
        table = export.ParameterTable(record.path, partial(record.tables, "parameters"))
        written = export.save(path, lambda path: export.TABLES[to](path, table), force=force)
        found = {"file": str(path), "rows": written.rows}
        print(to_json(found) if as_json else f"{path}: {written.rows} parameter values")
        return
    if lpv:
        from livebode.analysis.place_fits import lpv_model

        model = lpv_model(run)
        written = export.save(path, lambda path: export.MODELS[to](path, model), force=force)
        print(to_json({"file": str(path), "rows": written.rows}) if as_json else f"{path}: {written.rows} places")
        return
    if record.is_matrix:
        _no_time(record, at)
        written = export.save(path, lambda path: _write_matrices(record, path, to, mean), force=force)
    else:
        written = export.save(path, lambda path: _write_responses(record, path, to, at, mean), force=force)
    if as_json:
        print(to_json({"file": str(path), "rows": written.rows, "left_out": written.left_out}))
        return
    left_out = f"; {written.left_out} with fewer than two valid lines left out" if written.left_out else ""
    print(f"{path}: {counted(written.rows)} at {counted(len(record.lines), 'line')}{left_out}")


def _write_responses(record: RunRecord, path: Path, to: str, at: float | None, mean: bool) -> WriteResult:
    from livebode import export
    from livebode.core import Responses

    if at is not None:
        parts = iter([Responses.of(export.at(record.batches(), at))])
    elif mean:
        from livebode.analysis.averaged import mean_of

        parts = iter([mean_of(record)])
    else:
        parts = record.batches()
    return export.FORMATS[to](path, parts, record.summary)


def _write_matrices(record: RunRecord, path: Path, to: str, newest: bool) -> WriteResult:
    from livebode import export

    parts = iter([record.matrix().newest()]) if newest else record.matrix_batches()
    return export.MATRIX_FORMATS[to](path, parts, record.summary)


def _no_time(record: RunRecord, at: float | None) -> None:
    """UsageError if one time of a matrix run is to be exported: its matrices are from several experiments."""
    if at is not None:
        raise UsageError(
            "conflict",
            f"{record.place!r} is a matrix run, and each matrix is from several experiments, so --at has no meaning",
            "use --mean for the newest matrix, or select one entry with --entry",
            options=["--at"],
        )


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
