"""Tables of single responses: responses.parquet with a row for each line, parameters.parquet for each parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import PER_LINE, PER_RESPONSE, Lines, Parameters, Responses
from livebode.records.column_table import ColumnTable
from livebode.tables import Column, Schema, Table, Text

RESPONSE_SCHEMA = Schema.of(
    first="int64",
    sample="int64",
    time_s="float64",
    schedule="float64",
    frequency_hz="float64",
    re="float64",
    im="float64",
    sigma="float64",
    dof="float64",
    coherence="float64",
    valid="bool",
    input_coherence="float64",
    weight_re="float64",
    weight_im="float64",
    distortion="float64",
    ready="bool",
    variation="float64",
)
"""Columns: oldest and newest sample of the window, time of its centre (s), scheduling signal there, line (Hz), complex
response, sigma with its degrees of freedom, coherence of excitation and output, validity, coherence of excitation and
input, weight in a mean, distortion, whether the machine was ready in the whole window, variation. NaN for missing
values."""

RESPONSES = ColumnTable(
    RESPONSE_SCHEMA,
    ("first", "sample", "time_s", "schedule", "frequency_hz", "dof", "variation"),  # which is rarely known
    # Of what describes the accuracy: a sigma from m periods is known to 1/(2·√m).
    ("sigma", "coherence", "input_coherence", "weight_re", "weight_im", "distortion", "variation"),
)


def as_batch(responses: Responses) -> Table:
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
        responses.variation.ravel(),
    ]
    return Table(RESPONSE_SCHEMA, tuple(columns))


def with_variation(table: Table) -> Table:
    """Rows of responses, of which records from before the column `variation` lack it: it is not known there."""
    names = table.schema.names
    if "variation" in names or "ready" not in names:
        return table
    place = names.index("ready") + 1
    fields, columns = list(table.schema), list(table.columns)
    fields.insert(place, RESPONSE_SCHEMA.field("variation"))
    columns.insert(place, np.full(table.num_rows, np.nan))
    return Table(Schema(tuple(fields), table.schema.metadata), tuple(columns))


def _widened(column: NDArray[Any]) -> NDArray[Any]:
    """Doubles, where the table has rounded numbers."""
    return column.astype(np.float64) if column.dtype == np.float32 else column


def responses_in(table: Table, lines: Lines, found: Mapping[str, Any]) -> Responses:
    """The responses in complete rows of this table; `found` of run.json has quantity and unit."""
    shape = table.num_rows // len(lines), len(lines)
    column: dict[str, Any] = {name: _widened(table[name]).reshape(shape) for name in RESPONSE_SCHEMA.names}
    value = np.empty(shape, dtype=np.complex128)
    value.real, value.imag = column["re"], column["im"]
    per_line = {name: column[name] for name in PER_LINE if name in column}
    per_line["weight"] = np.empty(shape, dtype=np.complex128)
    per_line["weight"].real, per_line["weight"].imag = column["weight_re"], column["weight_im"]
    per_row = {name: column[name][:, 0] for name in PER_RESPONSE}
    named = {"quantity": found["quantity"], "unit": found["unit"]}
    return Responses(lines=lines, value=value, **per_line, **per_row, **named)


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
