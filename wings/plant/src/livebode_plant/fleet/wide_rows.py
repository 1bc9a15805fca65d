"""Responses and parameters of many axes as one table each: how results are stored in the log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from livebode.core import Parameters, Responses
from livebode.records import PARAMETER_SCHEMA, parameter_rows
from livebode.tables import from_numpy, text
from livebode_plant.lake.wide_responses import wide_schema

_PLACE = (("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()))
_DIGEST_BYTES = 8
_BITS = (
    "first", "sample", "time_s", "schedule", "dof", "ready", "valid", "value", "weight", "sigma", "coherence",
    "input_coherence", "distortion",
)  # fmt: skip


def _any_length(field: pa.Field[Any]) -> pa.Field[Any]:
    kind = field.type
    return field.with_type(pa.list_(kind.value_type)) if isinstance(kind, pa.FixedSizeListType) else field


_WIDE = [_any_length(field) for field in wide_schema(1)]
ROWS = pa.schema([*_PLACE, ("digest", pa.int64()), *_WIDE])
"""A row for each response: key of the axis; number in the log of the first message of its run; number of the response
within that run; digest of all its bits in full precision; and the columns of `wide_schema`, as lists of any length,
since the axes of a partition have different lines. `from_wide` reads those of one axis."""
PARAMETERS = pa.schema([*_PLACE, *pa.schema(PARAMETER_SCHEMA)])
"""A row for each parameter, derived quantity and margin of a fitted response, which has this number; the other columns
are those of parameters.parquet."""


class AxisRows(NamedTuple):
    """Consecutive responses of a run of an axis, from this number on."""

    axis: str
    run: int
    number: int
    responses: Responses


class AxesRows(NamedTuple):
    """A response of each of several axes: key, run and number of each row."""

    axes: Sequence[str]
    runs: Sequence[int]
    numbers: Sequence[int]
    responses: Responses

    @classmethod
    def of(cls, part: AxisRows) -> AxesRows:
        """The rows of one axis."""
        count = len(part.responses)
        numbers = range(part.number, part.number + count)
        return cls([part.axis] * count, [part.run] * count, numbers, part.responses)


class AxisFits(NamedTuple):
    """Parameters of the responses with these numbers, (rows,), of a run of an axis."""

    axis: str
    run: int
    numbers: NDArray[np.int64]
    parameters: Parameters


def response_table(parts: Sequence[AxisRows | AxesRows]) -> pa.Table:
    """Rows of `ROWS`, part by part. All axes are converted at once: each conversion costs as much as many rows."""
    if not parts:
        return ROWS.empty_table()
    found = [AxesRows.of(part) if isinstance(part, AxisRows) else part for part in parts]
    every = [part.responses for part in found]
    lines = np.repeat([len(one.lines) for one in every], [len(one) for one in every])
    ends = pa.array(np.concatenate([[0], np.cumsum(lines)]).astype(np.int32))
    words = [axis for part in found for axis in part.axes]
    columns: dict[str, pa.Array[Any]] = {
        "axis": text(words),
        "run": from_numpy(np.array([run for part in found for run in part.runs], dtype=np.int64)),
        "number": from_numpy(np.array([number for part in found for number in part.numbers], dtype=np.int64)),
        "digest": from_numpy(np.concatenate([digests(one) for one in every])),
    }
    with np.errstate(over="ignore", under="ignore"):
        for field in _WIDE:
            if isinstance(field.type, pa.ListType):
                kind = field.type.value_type.to_pandas_dtype()
                flat = np.concatenate([_quantity(one, field.name).ravel() for one in every]).astype(kind, copy=False)
                columns[field.name] = pa.ListArray.from_arrays(ends, from_numpy(flat))
            else:
                flat = np.concatenate([getattr(one, field.name) for one in every])
                columns[field.name] = from_numpy(flat.astype(field.type.to_pandas_dtype(), copy=False))
    return pa.Table.from_arrays([columns[name] for name in ROWS.names], schema=ROWS)


def parameter_table(parts: Sequence[AxisFits]) -> pa.Table:
    """Rows of `PARAMETERS`; axes with the same model are converted at once."""
    alike: dict[object, list[AxisFits]] = {}
    for part in parts:
        if len(part.parameters):
            fits = part.parameters
            alike.setdefault((fits.model, fits.names, fits.units), []).append(part)
    batches = []
    for members in alike.values():
        every = Parameters.join([part.parameters for part in members])
        width = len(every.names)
        counts = [width * len(part.numbers) for part in members]
        place = [
            text([part.axis for part in members], np.repeat(np.arange(len(members)), counts)),
            from_numpy(np.repeat([part.run for part in members], counts)),
            from_numpy(np.repeat(np.concatenate([part.numbers for part in members]), width)),
        ]
        batches.append(pa.Table.from_arrays([*place, *pa.table(parameter_rows(every)).columns], schema=PARAMETERS))
    return pa.concat_tables([PARAMETERS.empty_table(), *batches]).combine_chunks()


def digests(responses: Responses) -> NDArray[np.int64]:
    """A digest of all bits of each response, shape (rows,): stored rows are rounded, so it proves what was computed."""
    rows = len(responses)
    columns = [getattr(responses, name) for name in _BITS]
    table = np.hstack([np.ascontiguousarray(one).view(np.uint8).reshape(rows, -1) for one in columns])
    found = b"".join(blake2b(row, digest_size=_DIGEST_BYTES).digest() for row in table)
    return np.frombuffer(found, np.int64)


def grid_of(responses: Responses) -> Mapping[str, Any]:
    """What `from_wide` needs besides the rows: an entry ``found`` of run.json."""
    lines = responses.lines
    grid = {"bins": list(lines.bins), "quiet_bins": list(lines.quiet), "window": lines.window}
    return grid | {"rate_hz": lines.rate_hz, "quantity": responses.quantity, "unit": responses.unit}


def _quantity(responses: Responses, name: str) -> NDArray[Any]:
    """A column of lists, shape (rows, lines)."""
    if name in ("re", "im", "weight_re", "weight_im"):
        pair = responses.weight if name.startswith("weight") else responses.value
        return np.asarray(pair.real if name.endswith("re") else pair.imag)
    return np.asarray(getattr(responses, name))
