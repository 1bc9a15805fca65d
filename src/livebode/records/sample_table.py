"""samples: the raw samples of the channels in use, one row for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from livebode.arrow import from_numpy
from livebode.core import Block, Channel
from livebode.records.table_file import ColumnTable

_OWN = ("sample", "time_s")


def samples_of(channels: Sequence[Channel]) -> ColumnTable:
    """The table: number of the sample, its time (s), and a column for each channel with its unit in the metadata.

    A channel with the name of one of the first two columns gets an underscore after its name.
    """
    own = [pa.field("sample", pa.int64()), pa.field("time_s", pa.float64())]
    columns = [
        pa.field(c.name + "_" * (c.name in _OWN), pa.float64(), metadata={"unit": c.unit} if c.unit else None)
        for c in channels
    ]
    return ColumnTable(pa.schema(own + columns))


def channels_of(schema: pa.Schema) -> tuple[Channel, ...]:
    """The channels in a table of samples, with their units."""
    return tuple(
        Channel(
            field.name.removesuffix("_") if field.name.removesuffix("_") in _OWN else field.name,
            ((field.metadata or {}).get(b"unit") or b"").decode(),
        )
        for field in list(schema)[len(_OWN) :]
    )


def as_rows(blocks: Sequence[Block], table: ColumnTable) -> pa.RecordBatch:
    """The samples of Blocks whose channels are those of the table."""
    number = np.concatenate([np.arange(block.start, block.stop, dtype=np.int64) for block in blocks])
    time_s = np.concatenate([block.time_s for block in blocks])
    data = np.concatenate([block.data for block in blocks], axis=1)
    return pa.record_batch([from_numpy(c) for c in (number, time_s, *data)], schema=table.schema)
