"""parameters.parquet: one row for each response and parameter, readable with any tool."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from livebode.arrow import from_numpy, text
from livebode.core import Parameters
from livebode.records.table_file import ColumnTable

SCHEMA = pa.schema(
    [
        ("sample", pa.int64()),
        ("time_s", pa.float64()),
        ("schedule", pa.float64()),
        ("model", pa.string()),
        ("name", pa.string()),
        ("value", pa.float64()),
        ("sigma", pa.float64()),
        ("unit", pa.string()),
        ("status", pa.string()),
        ("epsilon", pa.float64()),
    ]
)
"""Columns: those of the response; model, parameter or derived quantity, its value and standard deviation (NaN if the
status is not "ok"), unit, status, and the model's misfit as a share of |G|."""

PARAMETERS = ColumnTable(SCHEMA, ("sample", "time_s", "schedule", "model", "name", "unit", "status"))


def parameter_rows(parameters: Parameters) -> pa.RecordBatch:
    """The parameters in long form."""
    rows, n = parameters.value.shape
    column = np.tile(np.arange(n), rows)
    statuses, status = np.unique(parameters.status, return_inverse=True)
    columns = [
        *(from_numpy(np.repeat(x, n)) for x in (parameters.sample, parameters.time_s, parameters.schedule)),
        text([parameters.model], np.zeros_like(column)),
        text(parameters.names, column),
        from_numpy(parameters.value.ravel()),
        from_numpy(parameters.sigma.ravel()),
        text(parameters.units, column),
        text(statuses.tolist(), np.repeat(status, n)),
        from_numpy(np.repeat(parameters.epsilon, n)),
    ]
    return pa.record_batch(columns, schema=SCHEMA)
