"""`livebode fleet replay`: the responses of one axis, computed again from the log, as a table."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.configuration.axis import Axis
from livebode.core.errors import FleetError
from livebode.core.files import whole_file
from livebode.core.writing import writing
from livebode.fleet.axis_stream import AxisStream
from livebode.fleet.log import FleetLog
from livebode.fleet.reader import stored_messages
from livebode.fleet.result_message import SCHEMA, response_rows
from livebode.fleet.subjects import LOG, LOG_STREAM, axis_path


async def replayed(log: FleetLog, key: str, axis: Axis, from_s: float) -> pa.Table:
    """The responses of the messages of an axis that the log has stored since `from_s` (seconds since 1970).

    The tracker begins at the first of them. The table has the columns of the stored results.

    Raises
    ------
    FleetError
        If the log has no such message.
    """
    subject = f"{LOG}.*.{key}"
    through = (await log.extent(LOG_STREAM)).last
    stream: AxisStream | None = None
    batches = []
    async for message in stored_messages(log, LOG_STREAM, subject, through):
        if message.stored_s < from_s:
            continue
        stream = stream or AxisStream(axis, message.number)
        output = stream.process(message.data, message.number, message.stored_s)
        if output.responses is not None:
            batches.append(response_rows(key, stream.run, output.number, output.responses))
    if stream is None:
        raise FleetError(
            "no-data",
            f"the log has no data of {axis_path(key)} in this time",
            "choose an earlier beginning; see age_days and size_gb in [log]",
            axis=axis_path(key),
        )
    return pa.Table.from_batches(batches, SCHEMA)


def write_replayed(table: pa.Table, path: Path) -> None:
    """Write the table as a Parquet file; OutputError if that is not possible."""
    with writing(path), whole_file(path) as partial:
        pq.write_table(table, partial)
