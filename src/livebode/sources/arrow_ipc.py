"""Arrow IPC by PyArrow, the file format (also called Feather 2) and the stream format: batch by batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar

import pyarrow as pa

from livebode.sources.arrow_values import schema_scalars, stored_columns, to_numpy
from livebode.sources.columnar import columns_of
from livebode.sources.recording import Chunk, Column, Recording

FILE_MAGIC = b"ARROW1"


class ArrowRecording(Recording):
    """An Arrow IPC file or stream; the number of samples is known only after reading."""

    format: ClassVar[str] = "arrow"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as file:
            self._is_file = file.read(len(FILE_MAGIC)) == FILE_MAGIC
        with self._opened(None) as reader:
            self.columns, self.skipped = columns_of(stored_columns(reader.schema), None)
            self.scalars = schema_scalars(reader.schema)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        del rows  # batches are as the writer cut them
        required = sorted({column.key for column in columns})
        places = [required.index(column.key) for column in columns]
        with self._opened(required) as reader:
            for batch in batches(reader):
                if batch.num_rows:
                    yield [to_numpy(batch.column(place)) for place in places]

    @contextmanager
    def _opened(
        self, fields: list[int] | None
    ) -> Iterator[pa.ipc.RecordBatchFileReader | pa.ipc.RecordBatchStreamReader]:
        options = pa.ipc.IpcReadOptions(included_fields=fields)
        with pa.OSFile(str(self.path)) as file:  # not mapped: if a mapped file shrinks, the process is killed
            if self._is_file:
                with pa.ipc.open_file(file, options=options) as reader:
                    yield reader
            else:
                with pa.ipc.open_stream(file, options=options) as stream:
                    yield stream


def batches(reader: pa.ipc.RecordBatchFileReader | pa.ipc.RecordBatchStreamReader) -> Iterator[pa.RecordBatch]:
    if isinstance(reader, pa.ipc.RecordBatchStreamReader):
        yield from reader
    else:
        for at in range(reader.num_record_batches):
            yield reader.get_batch(at)
