"""responses.parquet: one row for each response and line, readable with any tool."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from livebode.arrow import from_numpy
from livebode.core import Responses
from livebode.records.table_file import ColumnTable

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
        ("input_coherence", pa.float64()),
        ("weight_re", pa.float64()),
        ("weight_im", pa.float64()),
        ("distortion", pa.float64()),
        ("ready", pa.bool_()),
    ]
)
"""Columns: oldest and newest sample of the window, time of its centre (s), scheduling signal there, line (Hz), complex
response, sigma with its degrees of freedom, coherence of excitation and output, validity, coherence of excitation and
input, weight in a mean, distortion, whether the machine was ready in the whole window. NaN for missing values."""

EARLIER = SCHEMA.names[:-1]
"""Names of the columns of runs from before `signals.ready`: the machine was always ready."""

RESPONSES = ColumnTable(SCHEMA, ("first", "sample", "time_s", "schedule", "frequency_hz", "dof"))


def as_batch(responses: Responses) -> pa.RecordBatch:
    """The responses in long form, lines within a response in ascending order."""
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
        responses.input_coherence.ravel(),
        responses.weight.real.ravel(),
        responses.weight.imag.ravel(),
        responses.distortion.ravel(),
        np.repeat(responses.ready, lines),
    ]
    return pa.record_batch([from_numpy(c) for c in columns], schema=SCHEMA)
