"""`livebode export`: write a run in a format of other programs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.options import Json
from livebode.cli.remote import beside
from livebode.core import UsageError, counted
from livebode.locations import location

_IN_PYTHON = {
    "xarray": "livebode.Run(path).responses.to_xarray(); --to netcdf writes a file that xarray opens",
    "control": "livebode.Run(path).average.to_frd()",
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
    mean: Annotated[bool, typer.Option("--mean", help="Only the mean of the valid responses.")] = False,
    parameters: Annotated[
        bool, typer.Option("--parameters", help="Fitted parameters instead of responses; csv or mat.")
    ] = False,
    lpv: Annotated[
        bool, typer.Option("--lpv", help="The model over the schedule, with covariance: two masses fitted at places.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: Json = False,
) -> None:
    """Write the responses, the fitted parameters or the model over the position in a format of other programs."""
    from livebode import export
    from livebode.core import Responses
    from livebode.records import RunRecord, to_json

    formats = export.MODELS if lpv else export.TABLES if parameters else export.FORMATS
    chosen = {"--at": at is not None, "--mean": mean, "--parameters": parameters, "--lpv": lpv}
    _check(to, chosen, tuple(formats))
    record = RunRecord.open(run, output_only=parameters)
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
    if at is not None:
        parts = iter([Responses.of(export.at(record.batches(), at))])
    elif mean:
        from livebode.analysis.averaged import mean_of

        parts = iter([mean_of(record)])
    else:
        parts = record.batches()
    written = export.save(path, lambda path: export.FORMATS[to](path, parts, record.summary), force=force)
    if as_json:
        print(to_json({"file": str(path), "rows": written.rows, "left_out": written.left_out}))
        return
    left_out = f"; {written.left_out} with fewer than two valid lines left out" if written.left_out else ""
    print(f"{path}: {counted(written.rows)} at {counted(len(record.lines), 'line')}{left_out}")


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
