"""Responses in wide form: one row for each response, its lines as lists, for stores of very many runs.

The run directory has one row for each response and line (`response_table`), which any tool reads with one line of SQL.
An archive and a fleet store many years of them: the wide form has a third of the bytes, and one row instead of one for
each line. A matrix has a row for each entry, and for each element of the factors of its covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from livebode.core import REASONS, Lines, MatrixResponses, RecordError, Responses
from livebode.records import entry_summary, lines_in
from livebode.tables import from_numpy, text, to_numpy

_COMPLEX = {"value": ("re", "im"), "weight": ("weight_re", "weight_im")}
_REAL = ("sigma", "coherence", "input_coherence", "distortion", "variation")
_LEVEL = 3
_COUNTED, _ROUNDED = ("first", "sample"), ("schedule", "dof")


def wide_schema(lines: int, *, lossless: bool = False) -> pa.Schema:
    """The columns, with the names of the long form; those of a line are lists of fixed length.

    Numbers of samples are 64-bit integers and times are float64, both exact; all others are float32, with `lossless`
    float64. NaN marks missing values; there is no null.
    """
    number = pa.float64() if lossless else pa.float32()
    per_line = [name for pair in _COMPLEX.values() for name in pair] + list(_REAL)
    return pa.schema(
        [
            *((name, pa.int64()) for name in _COUNTED),
            ("time_s", pa.float64()),
            *((name, number) for name in _ROUNDED),
            ("ready", pa.bool_()),
            ("valid", pa.list_(pa.bool_(), lines)),
            *((name, pa.list_(number, lines)) for name in per_line),
        ]
    )


def to_wide(responses: Responses, *, lossless: bool = False) -> pa.Table:
    """The responses, one row for each, rounded to float32 unless `lossless`.

    Values beyond the range of float32 (3.4e38) become infinite, those below it (1e-45) zero.

    Examples
    --------
    >>> import livebode
    >>> responses = livebode.example_responses()
    >>> table = to_wide(responses)
    >>> table.num_rows, str(table.schema.field("re").type)
    (40, 'fixed_size_list<item: float>[13]')
    """
    schema = wide_schema(len(responses.lines), lossless=lossless)
    return pa.Table.from_arrays(wide_columns([responses], schema), schema=schema)


def wide_columns(batches: Sequence[Responses], schema: pa.Schema) -> list[pa.Array[Any]]:
    """The columns of this schema, batch by batch; lists of any length if the batches have different lines.

    All batches are converted at once: each conversion costs as much as many rows.
    """
    lines = np.repeat([len(batch.lines) for batch in batches], [len(batch) for batch in batches])
    ends = pa.array(np.concatenate([[0], np.cumsum(lines)]).astype(np.int32))
    with np.errstate(over="ignore", under="ignore"):
        return [
            as_arrow(np.concatenate([_quantity(batch, field.name).ravel() for batch in batches]), field.type, ends)
            for field in schema
        ]


def _quantity(responses: Responses, column: str) -> NDArray[Any]:
    """What a column has, shape (rows,) or (rows, lines)."""
    for name, (real, imaginary) in _COMPLEX.items():
        if column in (real, imaginary):
            values = getattr(responses, name)
            return np.asarray(values.real if column == real else values.imag)
    return np.asarray(getattr(responses, column))


def from_wide(table: pa.Table, found: Mapping[str, Any]) -> Responses:
    """The responses in rows of `to_wide`; other columns are ignored.

    Parameters
    ----------
    table
        Rows of one run, as they were written or as another program wrote them again: lists may have any type of list.
    found
        Entry ``found`` of run.json: grid, quantity and unit.

    Raises
    ------
    RecordError
        If a column is missing, contains null, or has another number of lines than the grid.

    Examples
    --------
    >>> import livebode
    >>> responses = livebode.example_responses()
    >>> lines = responses.lines
    >>> found = {"bins": lines.bins, "quiet_bins": lines.quiet, "window": lines.window, "rate_hz": lines.rate_hz}
    >>> found |= {"quantity": responses.quantity, "unit": responses.unit}
    >>> from_wide(to_wide(responses, lossless=True), found).equals(responses)
    True
    """
    lines = lines_in(found)
    schema = wide_schema(len(lines))
    column = {field.name: as_numpy(table, field, lines) for field in schema if field.name != "variation"}
    shape = table.num_rows, len(lines)
    stored = "variation" in table.column_names  # tables of earlier versions lack it
    column["variation"] = as_numpy(table, schema.field("variation"), lines) if stored else np.full(shape, np.nan)
    values: dict[str, Any] = {name: column[name] for name in (*_COUNTED, "ready", "valid")}
    for name in ("time_s", *_ROUNDED, *_REAL):
        values[name] = column[name].astype(np.float64, copy=False)
    for name, (real, imaginary) in _COMPLEX.items():
        values[name] = np.empty(column[real].shape, dtype=np.complex128)
        values[name].real, values[name].imag = column[real], column[imaginary]
    return Responses(lines=lines, quantity=found["quantity"], unit=found["unit"], **values)


def wide_options(schema: pa.Schema) -> dict[str, Any]:
    """Arguments of `pyarrow.parquet.write_table` or `ParquetWriter` for this schema, also with further columns.

    Bytes of equal place in numbers are stored together (byte-stream-split), so that exponents compress; numbers of
    samples as differences; zstd compresses all of it. Text, which repeats, has a dictionary.
    """
    encodings, repeating = {}, []
    for field in schema:
        kind, path = field.type, field.name
        if isinstance(kind, pa.FixedSizeListType | pa.ListType):
            kind, path = kind.value_type, f"{field.name}.list.element"
        if pa.types.is_floating(kind):
            encodings[path] = "BYTE_STREAM_SPLIT"
        elif pa.types.is_integer(kind):
            encodings[path] = "DELTA_BINARY_PACKED"
        elif pa.types.is_string(kind):
            repeating.append(path)
    return {
        "compression": "zstd",
        "compression_level": _LEVEL,
        "column_encoding": encodings,
        "use_dictionary": repeating or False,
    }


def as_arrow(values: NDArray[Any], kind: pa.DataType, ends: pa.Array[Any] | None = None) -> pa.Array[Any]:
    """A column of this type from its values in order; lists have a fixed length, or these `ends`, shape (rows + 1,)."""
    nested = pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind)
    flat = from_numpy(values.ravel().astype((kind.value_type if nested else kind).to_pandas_dtype(), copy=False))
    if pa.types.is_list(kind):
        return pa.ListArray.from_arrays(ends, flat)
    return pa.FixedSizeListArray.from_arrays(flat, type=kind) if nested else flat


def as_numpy(table: pa.Table, field: pa.Field[Any], lines: Lines) -> NDArray[Any]:
    """A column, shape (rows,), or of lists, shape (rows, lines); RecordError if it is missing or has other lists."""
    index = table.schema.get_field_index(field.name)
    if index < 0:
        raise unexpected_rows(f"has no column {field.name!r}")
    array = table.column(index).combine_chunks()
    if pa.types.is_fixed_size_list(field.type):
        if not len(array):
            return np.empty((0, len(lines)), dtype=field.type.value_type.to_pandas_dtype())
        lengths = pc.unique(pc.list_value_length(array)).to_pylist()
        if lengths != [len(lines)]:
            raise unexpected_rows(f"has {lengths[0]} lines in a row of {field.name!r}, and its grid has {len(lines)}")
        array = array.flatten()
    if array.null_count:
        raise unexpected_rows(f"has a null in {field.name!r}")
    return to_numpy(array).reshape(table.num_rows, -1) if pa.types.is_fixed_size_list(field.type) else to_numpy(array)


def unexpected_rows(what: str) -> RecordError:
    """The error of rows that are not from a run."""
    return RecordError("unexpected-content", f"the table of wide responses {what}", "write it again from the run")


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
    for responses in each.values():
        _check_rows(responses.sample, first.sample)
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
        variation=np.stack([np.stack([each[o, i].variation for i in inputs], axis=-1) for o in outputs], axis=-2),
    )


def _factor(
    covariance: pa.Table, factor: str, names: Sequence[str], lines: Lines, sample: NDArray[np.int64]
) -> NDArray[np.complex128]:
    """A factor of the covariance of the matrices with these samples, shape (rows, lines, names, names)."""
    schema = covariance_schema(len(lines))
    factors = np.empty((len(sample), len(lines), len(names), len(names)), dtype=np.complex128)
    for m, n in np.ndindex(len(names), len(names)):
        own = _where(covariance, factor=factor, row=names[m], column=names[n])
        _check_rows(as_numpy(own, schema.field("sample"), lines), sample)
        factors[:, :, m, n].real = as_numpy(own, schema.field("re"), lines)
        factors[:, :, m, n].imag = as_numpy(own, schema.field("im"), lines)
    return factors


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
