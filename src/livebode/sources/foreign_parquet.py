"""Parquet of other programs, by PyArrow: streamed in batches, only the requested columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

import pyarrow.parquet as pq

from livebode.sources.arrow_values import schema_scalars, stored_columns, to_numpy
from livebode.sources.columnar import columns_of
from livebode.sources.recording import Chunk, Column, Recording

BATCH_ROWS_MIN = 1 << 16
"""Smaller batches cost more in calls than they save in memory."""


class ForeignParquetRecording(Recording):
    """A Parquet file; `samples` is in its footer."""

    format: ClassVar[str] = "parquet"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with pq.ParquetFile(path) as file:
            self.columns, self.skipped = columns_of(stored_columns(file.schema_arrow), file.metadata.num_rows)
            self.scalars = schema_scalars(file.schema_arrow)
            self._names = file.schema_arrow.names

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        names = [self._names[column.key] for column in columns]
        # A column is read once, however often it is in `names`; batches have the file's order. With read-ahead the
        # whole file would be in memory at its end.
        with pq.ParquetFile(self.path, page_checksum_verification=True, pre_buffer=False) as file:
            for batch in file.iter_batches(max(rows, BATCH_ROWS_MIN), columns=names, use_threads=True):
                yield [to_numpy(batch.column(name)) for name in names]
