"""Matrices of responses in wide form: a row for each entry, and for each element of the factors of the covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from livebode.core import REASONS, Lines, MatrixResponses
from livebode.records import entry_summary, lines_in
from livebode.tables import from_numpy, text, to_numpy
from livebode_plant.lake.wide_responses import as_arrow, as_numpy, from_wide, to_wide, unexpected_rows, wide_schema

_NUMBER = pa.float32()


def entry_schema(lines: int) -> pa.Schema:
    """The columns of a row for each entry: those of `wide_schema`, and those that only a matrix has.

    These are the names of the entry, and with a value for each line the condition number of the inputs, and the reason
    why the column of the matrix is invalid ("" where it is valid).
    """
    more = [
        ("output", pa.string()),
        ("input", pa.string()),
        ("condition", pa.list_(_NUMBER, lines)),
        ("reason", pa.list_(pa.string(), lines)),
    ]
    return pa.schema([*wide_schema(lines), *more])


def covariance_schema(lines: int) -> pa.Schema:
    """The columns of covariance.parquet of a run, with a value for each line in the lists."""
    return pa.schema(
        [
            ("sample", pa.int64()),
            ("time_s", pa.float64()),
            *((name, pa.string()) for name in ("factor", "row", "column")),
            *((name, pa.list_(_NUMBER, lines)) for name in ("re", "im")),
        ]
    )


def entries_to_wide(responses: MatrixResponses) -> pa.Table:
    """A row for each entry of each matrix, rounded to float32.

    >>> from livebode_matrix import example_matrix_responses
    >>> entries_to_wide(example_matrix_responses()).num_rows
    12
    """
    schema = entry_schema(len(responses.lines))
    condition = as_arrow(responses.condition, schema.field("condition").type)
    parts = [
        pa.Table.from_arrays(
            [
                *to_wide(responses.entry(o, i)).columns,
                *(_repeated(name, len(responses)) for name in (o, i)),
                condition,
                _words(responses.reason[:, :, number]),
            ],
            schema=schema,
        )
        for o in responses.outputs
        for number, i in enumerate(responses.inputs)
    ]
    return pa.concat_tables(parts).sort_by("sample")


def covariance_to_wide(responses: MatrixResponses) -> pa.Table:
    """A row for each element of the two factors of the covariance of each matrix, rounded to float32.

    >>> from livebode_matrix import example_matrix_responses
    >>> covariance_to_wide(example_matrix_responses()).num_rows
    24
    """
    schema = covariance_schema(len(responses.lines))
    kind = schema.field("re").type
    factors = {"noise": (responses.outputs, responses.noise), "spread": (responses.inputs, responses.spread)}
    parts = []
    for factor, (names, values) in factors.items():
        for m, n in np.ndindex(len(names), len(names)):
            words = [_repeated(word, len(responses)) for word in (factor, names[m], names[n])]
            numbers = [as_arrow(part, kind) for part in (values[:, :, m, n].real, values[:, :, m, n].imag)]
            times = [from_numpy(responses.sample), from_numpy(responses.time_s)]
            parts.append(pa.Table.from_arrays([*times, *words, *numbers], schema=schema))
    return pa.concat_tables(parts).sort_by("sample")


def matrices_from_wide(entries: pa.Table, covariance: pa.Table, summary: Mapping[str, Any]) -> MatrixResponses:
    """The matrices in rows of `entries_to_wide` and `covariance_to_wide`, which are ordered by their samples.

    Parameters
    ----------
    entries, covariance
        All rows of one run; other columns are ignored.
    summary
        run.json: its `found` has grid, signals and units.

    Raises
    ------
    RecordError
        If a column is missing, or an entry or the covariance has not a row for each matrix.
    """
    found = summary["found"]
    lines, outputs, inputs = lines_in(found), tuple(found["outputs"]), tuple(found["inputs"])
    tables = {(o, i): _where(entries, output=o, input=i) for o in outputs for i in inputs}
    each = {of: from_wide(table, entry_summary(summary, *of)["found"]) for of, table in tables.items()}
    first = each[outputs[0], inputs[0]]
    for one in each.values():
        _check_rows(one.sample, first.sample)
    at_input = [tables[outputs[0], i] for i in inputs]
    return MatrixResponses(
        lines,
        outputs,
        inputs,
        value=np.stack([np.stack([each[o, i].value for i in inputs], axis=-1) for o in outputs], axis=-2),
        noise=_factor(covariance, "noise", outputs, lines, first.sample),
        spread=_factor(covariance, "spread", inputs, lines, first.sample),
        dof=first.dof,
        coherence=np.stack([each[o, inputs[0]].coherence for o in outputs], axis=-1),
        condition=as_numpy(at_input[0], entry_schema(len(lines)).field("condition"), lines).astype(np.float64),
        reason=np.stack([_reasons(table, len(lines)) for table in at_input], axis=-1),
        first=first.first,
        sample=first.sample,
        time_s=first.time_s,
        units=tuple(map(tuple, found["units"])),
    )


def _factor(
    covariance: pa.Table, factor: str, names: Sequence[str], lines: Lines, sample: NDArray[np.int64]
) -> NDArray[np.complex128]:
    """A factor of the covariance of the matrices with these samples, shape (rows, lines, names, names)."""
    schema = covariance_schema(len(lines))
    found = np.empty((len(sample), len(lines), len(names), len(names)), dtype=np.complex128)
    for m, n in np.ndindex(len(names), len(names)):
        own = _where(covariance, factor=factor, row=names[m], column=names[n])
        _check_rows(as_numpy(own, schema.field("sample"), lines), sample)
        found[:, :, m, n].real = as_numpy(own, schema.field("re"), lines)
        found[:, :, m, n].imag = as_numpy(own, schema.field("im"), lines)
    return found


def _check_rows(own: NDArray[np.int64], expected: NDArray[np.int64]) -> None:
    if not np.array_equal(own, expected):
        raise unexpected_rows("has not a row of each entry and of each element of the covariance for every matrix")


def _where(table: pa.Table, **words: str) -> pa.Table:
    """The rows with these words in their columns, with one chunk for each column."""
    for name in words:
        if name not in table.column_names:
            raise unexpected_rows(f"has no column {name!r}")
    use = [pc.equal(table[name], word) for name, word in words.items()]
    for more in use[1:]:
        use[0] = pc.and_(use[0], more)
    return table.filter(use[0]).combine_chunks()


def _repeated(word: str, rows: int) -> pa.Array[Any]:
    return text([word], np.zeros(rows, dtype=np.int64))


def _words(reason: NDArray[np.int8]) -> pa.Array[Any]:
    """Lists of reasons, shape (rows, lines)."""
    flat = text(list(REASONS), reason.ravel().astype(np.int64))
    return pa.FixedSizeListArray.from_arrays(flat, reason.shape[1])


def _reasons(table: pa.Table, lines: int) -> NDArray[np.int8]:
    """Their numbers, shape (rows, lines); a reason of a later version counts as incomplete."""
    flat = table["reason"].combine_chunks().flatten()
    if flat.null_count or len(flat) != table.num_rows * lines:
        raise unexpected_rows("has other lines in a row of 'reason' than its grid")
    numbers = pc.fill_null(pc.index_in(flat, text(list(REASONS))), 1)
    return to_numpy(numbers).astype(np.int8).reshape(table.num_rows, lines)
