"""responses.parquet: one row for each response and line, that any tool reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.arrow import from_numpy
from livebode.nouns import Responses
from livebode.records.table import Table

SCHEMA = pa.schema(
    [
        ("first", pa.int64()),
        ("sample", pa.int64()),
        ("time_s", pa.float64()),
        ("schedule", pa.float64()),
        ("frequency_hz", pa.float64()),
        ("re", pa.float64()),
        ("im", pa.float64()),
        ("sigma", pa.float64()),
        ("dof", pa.float64()),
        ("coherence", pa.float64()),
        ("valid", pa.bool_()),
    ]
)
"""Columns: oldest and newest sample that went in, time of the centre (s), scheduling signal there, line (Hz), complex
response, sigma with its degrees of freedom, coherence, validity. NaN where there is no value."""

RESPONSES = Table(SCHEMA, ("first", "sample", "time_s", "schedule", "frequency_hz", "dof"))
_GROUP_ROWS = 1 << 18


class ResponseTable:
    """Appends Responses to a Parquet file in long form, by row groups of bounded size."""

    def __init__(self, path: Path) -> None:
        self._file = pq.ParquetWriter(path, SCHEMA, use_dictionary=list(RESPONSES.repeating), compression="lz4")
        self._waiting: list[pa.RecordBatch] = []
        self._rows = 0

    def write(self, responses: Responses) -> None:
        """Append every line of every response, lines within a response in ascending order."""
        if not len(responses):
            return
        batch = as_batch(responses)
        self._waiting.append(batch)
        self._rows += batch.num_rows
        if self._rows >= _GROUP_ROWS:
            self._flush()

    def close(self) -> None:
        self._flush()
        self._file.close()

    def _flush(self) -> None:
        if self._waiting:
            self._file.write_table(pa.Table.from_batches(self._waiting, SCHEMA), row_group_size=_GROUP_ROWS)
        self._waiting, self._rows = [], 0


def as_batch(responses: Responses) -> pa.RecordBatch:
    """The responses in long form."""
    rows, lines = responses.value.shape
    per_row = [np.repeat(x, lines) for x in (responses.first, responses.sample, responses.time_s, responses.schedule)]
    per_line = np.tile(responses.lines.frequency_hz, rows)
    value = responses.value.ravel()
    columns = [
        *per_row,
        per_line,
        value.real,
        value.imag,
        responses.sigma.ravel(),
        np.repeat(responses.dof, lines),
        responses.coherence.ravel(),
        responses.valid.ravel(),
    ]
    return pa.record_batch([from_numpy(c) for c in columns], schema=SCHEMA)
