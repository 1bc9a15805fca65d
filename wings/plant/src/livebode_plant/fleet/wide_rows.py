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
from livebode_plant.lake.wide_responses import wide_columns, wide_schema

_PLACE = (("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()))
_DIGEST_BYTES = 8
_BITS = (
    "first", "sample", "time_s", "schedule", "dof", "ready", "valid", "value", "weight", "sigma", "coherence",
    "input_coherence", "distortion",
)  # fmt: skip
_WIDE = pa.schema(
    [
        field.with_type(pa.list_(field.type.value_type)) if pa.types.is_fixed_size_list(field.type) else field
        for field in wide_schema(1)
    ]
)
ROWS = pa.schema([*_PLACE, ("digest", pa.int64()), *_WIDE])
"""A row for each response: key of the axis; number in the log of the first message of its run; number of the response
within that run; digest of all its bits in full precision; and the columns of `wide_schema`, as lists of any length,
since the axes of a partition have different lines. `from_wide` reads those of one axis."""
PARAMETERS = pa.schema([*_PLACE, *pa.schema(PARAMETER_SCHEMA)])
"""A row for each parameter, derived quantity and margin of a fitted response, which has this number; the other columns
are those of parameters.parquet."""


class AxisRows(NamedTuple):
    """Responses of one axis or of several: key, run and number of each row."""

    axes: Sequence[str]
    runs: Sequence[int]
    numbers: Sequence[int]
    responses: Responses

    @classmethod
    def of(cls, axis: str, run: int, number: int, responses: Responses) -> AxisRows:
        """Consecutive responses of a run of an axis, from this number on."""
        count = len(responses)
        return cls([axis] * count, [run] * count, range(number, number + count), responses)


class AxisFits(NamedTuple):
    """Parameters of the responses with these numbers, (rows,), of a run of an axis."""

    axis: str
    run: int
    numbers: NDArray[np.int64]
    parameters: Parameters


def response_table(parts: Sequence[AxisRows]) -> pa.Table:
    """Rows of `ROWS`, part by part."""
    if not parts:
        return ROWS.empty_table()
    every = [part.responses for part in parts]
    own = [
        text([axis for part in parts for axis in part.axes]),
        from_numpy(np.array([run for part in parts for run in part.runs], dtype=np.int64)),
        from_numpy(np.array([number for part in parts for number in part.numbers], dtype=np.int64)),
        from_numpy(np.concatenate([digests(batch) for batch in every])),
    ]
    return pa.Table.from_arrays([*own, *wide_columns(every, _WIDE)], schema=ROWS)


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
