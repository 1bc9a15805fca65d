"""parameters.parquet: one row for each response and parameter, that any tool reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.arrow import from_numpy, text
from livebode.nouns import Parameters
from livebode.records.table import Table

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
"""Columns: those of the response; model, parameter or derived quantity, its value and standard deviation (NaN where the
status is not "ok"), unit, status, and what the model lacks as a share of |G|."""

PARAMETERS = Table(SCHEMA, ("sample", "time_s", "schedule", "model", "name", "unit", "status"))

_GROUP_ROWS = 1 << 17


class ParameterTable:
    """Appends Parameters to a Parquet file in long form, by row groups of bounded size."""

    def __init__(self, path: Path) -> None:
        self._file = pq.ParquetWriter(path, SCHEMA, compression="lz4")
        self._waiting: list[pa.RecordBatch] = []
        self._rows = 0

    def write(self, *parts: Parameters) -> None:
        """Append what was fitted and what follows from it, of the same responses."""
        for parameters in parts:
            if len(parameters):
                self._waiting.append(parameter_rows(parameters))
                self._rows += self._waiting[-1].num_rows
        if self._rows >= _GROUP_ROWS:
            self._flush()

    def close(self) -> None:
        self._flush()
        self._file.close()

    def _flush(self) -> None:
        if self._waiting:
            self._file.write_table(pa.Table.from_batches(self._waiting, SCHEMA))
        self._waiting, self._rows = [], 0


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
