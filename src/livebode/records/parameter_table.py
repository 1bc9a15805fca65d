"""parameters.parquet: one row for each response and parameter, readable with any tool."""

from __future__ import annotations

import numpy as np

from livebode.core import Parameters
from livebode.records.table_file import ColumnTable
from livebode.tables import Column, Schema, Table, Text

PARAMETER_SCHEMA = Schema.of(
    sample="int64",
    time_s="float64",
    schedule="float64",
    model="string",
    name="string",
    value="float64",
    sigma="float64",
    unit="string",
    status="string",
    epsilon="float64",
)
"""Columns: those of the response; model, parameter or derived quantity, its value and standard deviation (NaN if the
status is not "ok"), unit, status, and the model's misfit as a share of |G|."""

PARAMETERS = ColumnTable(PARAMETER_SCHEMA, ("sample", "time_s", "schedule", "model", "name", "unit", "status"))


def parameter_rows(parameters: Parameters) -> Table:
    """The parameters in long form."""
    rows, n = parameters.value.shape
    column = np.tile(np.arange(n), rows)
    statuses, status = np.unique(parameters.status, return_inverse=True)
    columns: list[Column] = [
        *(np.repeat(x, n) for x in (parameters.sample, parameters.time_s, parameters.schedule)),
        Text.of([parameters.model], np.zeros_like(column)),
        Text.of(parameters.names, column),
        parameters.value.ravel(),
        parameters.sigma.ravel(),
        Text.of(parameters.units, column),
        Text.of(statuses.tolist(), np.repeat(status, n)),
        np.repeat(parameters.epsilon, n),
    ]
    return Table(PARAMETER_SCHEMA, tuple(columns))
