"""samples: the raw samples of the channels in use, one row for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.core import Block, Channel
from livebode.records.column_table import ColumnTable
from livebode.tables import Field, Schema, Table

_OWN = ("sample", "time_s")


def samples_of(channels: Sequence[Channel]) -> ColumnTable:
    """The table: number of the sample, its time (s), and a column for each channel with its units in the metadata.

    `source_unit` is the unit in the source, where its values times `factor` are the samples.
    A channel with the name of one of the first two columns gets an underscore after its name.
    """
    own = [Field("sample", "int64"), Field("time_s", "float64")]
    columns = [Field(c.name + "_" * (c.name in _OWN), "float64", _units(c)) for c in channels]
    return ColumnTable(Schema((*own, *columns)))


def channels_of(schema: Schema) -> tuple[Channel, ...]:
    """The channels in a table of samples, with their units."""
    return tuple(
        Channel(
            field.name.removesuffix("_") if field.name.removesuffix("_") in _OWN else field.name,
            field.metadata.get("unit", ""),
            written=field.metadata.get("source_unit", ""),
            factor=float(field.metadata.get("factor", 1)),
        )
        for field in schema.fields[len(_OWN) :]
    )


def _units(channel: Channel) -> dict[str, str]:
    units = {"unit": channel.unit} if channel.unit else {}
    if channel.factor == 1:
        return units
    return units | {"source_unit": channel.source_unit, "factor": repr(channel.factor)}


def as_rows(blocks: Sequence[Block], table: ColumnTable) -> Table:
    """The samples of Blocks whose channels are those of the table."""
    number = np.concatenate([np.arange(block.start, block.stop, dtype=np.int64) for block in blocks])
    time_s = np.concatenate([block.time_s for block in blocks])
    data = np.concatenate([block.data for block in blocks], axis=1)
    return Table(table.schema, (number, time_s, *data))
