"""Modes of a matrix run, and the machine between two of them."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from livebode.configuration import FitSection, read_table, shortened
from livebode.core import UsageError, counted, nearest_name
from livebode.fitting import Kind
from livebode.mimo import MatrixModes, fit_matrix, mean_matrix
from livebode.records import RunRecord
from livebode.simulation import Gantry


def fit_matrix_run(
    run: RunRecord, model: Kind, section: FitSection, order: int | None = None
) -> tuple[MatrixModes, list[str]]:
    """Poles common to all entries of a matrix run, and remarks; raises the errors of `fit_matrix`."""
    responses = run.matrix()
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    mean = mean_matrix(responses)
    found = fit_matrix(responses, model, order=order, band_hz=band, hold=section.hold)
    return found, [f"fitted to the mean of the matrices that share no window, {mean.dof[0]:.0f} degrees of freedom"]


def read_gantry(path: Path) -> Gantry:
    """The gantry that a TOML file describes: numbers with the names of `Gantry`.

    Raises
    ------
    ConfigError
        If the file cannot be read or is not TOML.
    UsageError
        If a name is not one of a gantry's, a value is not a number, or is out of range.
    """
    table = read_table(path)
    names = [field.name for field in fields(Gantry)]
    values: dict[str, Any] = {}
    for name, value in table.items():
        if name not in names:
            raise UsageError(
                "unknown-name",
                f"{str(path)!r}: a gantry has no parameter {name!r}",
                nearest_name(name, names, "Parameters of a gantry"),
                argument="gantry",
                value=name,
                allowed=names,
            )
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(
                "not-finite",
                f"{str(path)!r}: {name} = {shortened(value)} is not a number",
                "write one in the unit of the name",
                argument="gantry",
                value=shortened(value),
            )
        values[name] = float(value)
    missing = [name for name in names if name not in values and not name.startswith("right_")]
    if missing:
        raise UsageError(
            "missing",
            f"{str(path)!r} lacks {counted(len(missing), 'parameter')} of the gantry: {', '.join(missing)}",
            "specify them, as far as they are known; belts, masses and damping are fitted",
            argument="gantry",
            missing=missing,
        )
    return Gantry(**values)
