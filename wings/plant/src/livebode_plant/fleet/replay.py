"""`livebode fleet replay`: the responses and fits of one axis, computed again from the log, as tables."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.configuration import Axis
from livebode.core import FleetError, Responses, whole_file, writing
from livebode.records import RESPONSE_SCHEMA, as_batch
from livebode.tables import from_numpy, text
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.subjects import LOG, LOG_STREAM, axis_path
from livebode_plant.fleet.wide_rows import AxisFits, parameter_table

SCHEMA = pa.schema([("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()), *pa.schema(RESPONSE_SCHEMA)])
"""Columns: key of the axis, number in the log of the first message of its run, number of the response within that run,
and those of responses.parquet, in full precision."""


class ReplayedAxis(NamedTuple):
    """Responses with the columns of `SCHEMA`; fits, derived quantities and margins with those of
    `wide_rows.PARAMETERS`, None without [fit]."""

    responses: pa.Table
    parameters: pa.Table | None


async def replayed(log: FleetLog, key: str, axis: Axis, from_s: float) -> ReplayedAxis:
    """What the messages of an axis give that the log has stored since `from_s` (seconds since 1970).

    The tracker begins at the first of them.

    Raises
    ------
    FleetError
        If the log has no such message, or the axis cannot be tracked from the first one on.
    """
    subject = f"{LOG}.*.{key}"
    through = (await log.extent(LOG_STREAM)).last
    stream: AxisStream | None = None
    batches, fits = [], []
    async for message in stored_messages(log, LOG_STREAM, subject, through):
        if message.stored_s < from_s:
            continue
        stream = stream or AxisStream(axis, message.number)
        output = stream.process(message.data, message.number, message.stored_s)
        if output.responses is not None:
            batches.append(_response_rows(key, stream.run, output.number, output.responses))
        fits += [AxisFits(key, stream.run, output.fitted, one) for one in output.parameters]
    if stream is None:
        raise FleetError(
            "no-data",
            f"the log has no data of {axis_path(key)} in this time",
            "choose an earlier beginning; see age_days and size_gb in [log]",
            axis=axis_path(key),
        )
    if stream.failure and not batches:
        raise FleetError(
            "axis-failed",
            f"{axis_path(key)} cannot be tracked: {stream.failure}",
            "repair its configuration or its sender, and choose a beginning after that",
            axis=axis_path(key),
        )
    parameters = None if axis.fit is None else parameter_table(fits)
    return ReplayedAxis(pa.concat_tables([SCHEMA.empty_table(), *batches]), parameters)


def _response_rows(key: str, run: int, number: int, responses: Responses) -> pa.Table:
    """The responses of an axis's run that begin with this number."""
    numbers = np.repeat(np.arange(number, number + len(responses)), len(responses.lines))
    place = [text([key], np.zeros_like(numbers)), from_numpy(np.full_like(numbers, run)), from_numpy(numbers)]
    return pa.Table.from_arrays([*place, *pa.table(as_batch(responses)).columns], schema=SCHEMA)


def write_replayed(found: ReplayedAxis, path: Path) -> dict[Path, int]:
    """Write the responses as a Parquet file, and beside it the parameters; OutputError if that is not possible.

    Returns the rows of each file, NAME.parquet and NAME-parameters.parquet.
    """
    tables = {path: found.responses}
    if found.parameters is not None:
        tables[path.with_stem(f"{path.stem}-parameters")] = found.parameters
    for place, table in tables.items():
        with writing(place), whole_file(place) as partial:
            pq.write_table(table, partial)
    return {place: table.num_rows for place, table in tables.items()}
