"""The tables of a matrix run: responses.parquet with an entry of the matrix in each row, and covariance.parquet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex
from livebode.core import REASONS, Lines, MatrixResponses
from livebode.dataclass import dataclass
from livebode.records import response_table
from livebode.records._result_rows import result_rows
from livebode.records.column_table import ColumnTable
from livebode.tables import Field, Schema, Table, Text

SCHEMA = Schema(
    (
        *response_table.RESPONSE_SCHEMA,
        Field("output", "string"),
        Field("input", "string"),
        Field("condition", "float64"),
        Field("reason", "string"),
    )
)
"""Columns: those of any run for the response from one input to one output, the names of these, the condition number of
the inputs, and the reason why the column of the matrix is invalid ("" where it is valid)."""

COVARIANCE_SCHEMA = Schema.of(
    sample="int64",
    time_s="float64",
    frequency_hz="float64",
    factor="string",
    row="string",
    column="string",
    re="float64",
    im="float64",
)
"""Columns: those of the response; factor of the covariance, "noise" between outputs or "spread" between inputs; names
of two signals, and the element of the factor at these. The covariance of the entries is the Kronecker product of the
two factors."""

MATRIX_RESPONSES = ColumnTable(
    SCHEMA, (*response_table.RESPONSES.repeating, "output", "input", "condition", "reason", "schedule")
)
COVARIANCE = ColumnTable(COVARIANCE_SCHEMA, ("sample", "time_s", "frequency_hz", "factor", "row", "column"))
MATRIX_TABLES: Mapping[str, ColumnTable] = {"responses": MATRIX_RESPONSES, "covariance": COVARIANCE}
"""Tables of a matrix run."""


@dataclass(frozen=True)
class MatrixShape:
    """Lines and signals of a matrix run, by which its rows become matrices again."""

    lines: Lines
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]

    @property
    def response_rows(self) -> int:
        """Rows of one response in responses.parquet."""
        return len(self.lines) * len(self.outputs) * len(self.inputs)

    @property
    def covariance_rows(self) -> int:
        """Rows of one response in covariance.parquet."""
        return len(self.lines) * (len(self.outputs) ** 2 + len(self.inputs) ** 2)


@result_rows.register
def _(results: MatrixResponses) -> Mapping[str, Table]:
    return {"responses": matrix_rows(results), "covariance": covariance_rows(results)}


def matrix_rows(responses: MatrixResponses) -> Table:
    """The entries in long form: lines within a response, outputs within a line, inputs within an output."""
    outputs, inputs = responses.outputs, responses.inputs
    entries = [response_table.as_batch(responses.entry(o, i)) for o in outputs for i in inputs]
    columns: list[Any] = [
        np.stack([entry[name] for entry in entries], axis=1).ravel() for name in response_table.RESPONSE_SCHEMA.names
    ]
    cells = len(responses) * len(responses.lines)
    output, input = (at.ravel() for at in np.indices((len(outputs), len(inputs))))
    columns += [Text.of(outputs, np.tile(output, cells)), Text.of(inputs, np.tile(input, cells))]
    columns.append(np.repeat(responses.condition.ravel(), len(entries)))
    reason = np.repeat(responses.reason[:, :, np.newaxis, :], len(outputs), axis=2)
    columns.append(Text.of(REASONS, reason.ravel()))
    return Table(SCHEMA, tuple(columns))


def covariance_rows(responses: MatrixResponses) -> Table:
    """The factors of the covariance in long form: lines within a response, then "noise" and "spread" by rows."""
    flat = [factor.reshape(*factor.shape[:2], factor.shape[2] ** 2) for factor in (responses.noise, responses.spread)]
    value = np.concatenate(flat, axis=2)
    rows, lines, size = value.shape
    numbers = [np.indices((len(names), len(names))).reshape(2, -1) for names in (responses.outputs, responses.inputs)]
    names = (*responses.outputs, *responses.inputs)
    row, column = np.concatenate([numbers[0], numbers[1] + len(responses.outputs)], axis=1)
    of = np.repeat([0, 1], [numbers[0].shape[1], numbers[1].shape[1]])
    columns: list[Any] = [
        np.repeat(responses.sample, lines * size),
        np.repeat(responses.time_s, lines * size),
        np.tile(np.repeat(responses.frequency_hz, size), rows),
        Text.of(("noise", "spread"), np.tile(of, rows * lines)),
        Text.of(names, np.tile(row, rows * lines)),
        Text.of(names, np.tile(column, rows * lines)),
        value.real.ravel(),
        value.imag.ravel(),
    ]
    return Table(COVARIANCE_SCHEMA, tuple(columns))


def entry_rows(
    table: Table, output: str, input: str, columns: Sequence[str] = tuple(response_table.RESPONSE_SCHEMA.names)
) -> Table:
    """The rows of one entry, with the columns of any run."""
    chosen = table.text("output").where(output) & table.text("input").where(input)
    plain = table.select(list(columns))
    return Table(plain.schema, tuple(column[np.flatnonzero(chosen)] for column in plain.columns))


def matrices(responses: Iterable[Table], covariance: Iterable[Table], shape: MatrixShape) -> Iterator[MatrixResponses]:
    """The matrices in complete rows of the two tables, which are read side by side.

    Where the covariance of a response was lost by damage, `noise` and `spread` are NaN.
    """
    factors = _Factors(covariance, shape)
    for table in responses:
        yield _matrix(table, factors, shape)


class _Factors:
    """The factors of the covariance by the sample of their response, read as far as needed."""

    def __init__(self, tables: Iterable[Table], shape: MatrixShape) -> None:
        self._tables, self._shape = iter(tables), shape
        self._sample = np.empty(0, dtype=np.int64)
        self._value = np.empty((0, len(shape.lines), shape.covariance_rows // len(shape.lines)), dtype=np.complex128)

    def of(self, sample: NDArray[np.int64]) -> tuple[Complex, Complex]:
        """Noise and spread of these responses, in ascending order of their samples."""
        while len(sample) and (not self._sample.size or self._sample[-1] < sample[-1]):
            table = next(self._tables, None)
            if table is None:
                break
            self._append(table)
        factors = np.full((len(sample), *self._value.shape[1:]), complex(np.nan, np.nan))
        places = np.searchsorted(self._sample, sample)
        known = np.flatnonzero(places < len(self._sample))
        known = known[self._sample[places[known]] == sample[known]]
        factors[known] = self._value[places[known]]
        if len(sample):
            after = int(np.searchsorted(self._sample, sample[-1], side="right"))
            self._sample, self._value = self._sample[after:], self._value[after:]
        noise, spread = np.split(factors, [len(self._shape.outputs) ** 2], axis=2)
        sizes = (len(self._shape.outputs), len(self._shape.inputs))
        rows = (len(sample), len(self._shape.lines))
        return noise.reshape(*rows, sizes[0], sizes[0]), spread.reshape(*rows, sizes[1], sizes[1])

    def _append(self, table: Table) -> None:
        shape = (table.num_rows // self._shape.covariance_rows, *self._value.shape[1:])
        value = _complex(table, shape)
        sample = table["sample"][:: self._shape.covariance_rows]
        self._sample = np.concatenate([self._sample, sample])
        self._value = np.concatenate([self._value, value])


def _matrix(table: Table, factors: _Factors, shape: MatrixShape) -> MatrixResponses:
    lines, outputs, inputs = len(shape.lines), len(shape.outputs), len(shape.inputs)
    whole = table.num_rows // shape.response_rows, lines, outputs, inputs
    names = ("first", "sample", "time_s", "dof", "coherence", "condition")
    number = {name: table[name].reshape(whole) for name in names}
    first, sample, time_s, dof = (number[name][:, 0, 0, 0] for name in ("first", "sample", "time_s", "dof"))
    noise, spread = factors.of(sample)
    return MatrixResponses(
        shape.lines,
        shape.outputs,
        shape.inputs,
        value=_complex(table, whole),
        noise=noise,
        spread=spread,
        dof=dof,
        coherence=number["coherence"][..., 0],
        condition=number["condition"][..., 0, 0],
        reason=_reasons(table.text("reason")).reshape(whole)[:, :, 0, :],
        first=first,
        sample=sample,
        time_s=time_s,
        variation=table["variation"].reshape(whole),
    )


def _reasons(words: Text) -> NDArray[np.int8]:
    """Their numbers; a reason of a later version counts as incomplete."""
    numbers = [REASONS.index(word) if word in REASONS else 1 for word in words.words]
    return np.array(numbers or [0], dtype=np.int8)[words.at]


def _complex(table: Table, shape: Sequence[int]) -> Complex:
    found = np.empty(tuple(shape), dtype=np.complex128)
    found.real, found.imag = table["re"].reshape(found.shape), table["im"].reshape(found.shape)
    return found
