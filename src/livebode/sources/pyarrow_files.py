"""Recordings that PyArrow reads: Parquet files of other programs and Arrow IPC, batch by batch (extra `parquet`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from livebode import tables
from livebode.sources.columnar import Content, StoredColumn, columns_of, scalars_of
from livebode.sources.recording import Chunk, Column, Recording, check_packed

_NANOSECONDS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
BATCH_ROWS_MIN = 1 << 16
"""Smaller batches cost more in calls than they save in memory."""
FILE_MAGIC = b"ARROW1"


class ForeignParquetRecording(Recording):
    """A Parquet file; `samples` is in its footer."""

    format: ClassVar[str] = "parquet"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with pq.ParquetFile(path) as file:
            check_packed(path, file.metadata.num_rows * file.metadata.num_columns)
            self.columns, self.skipped = columns_of(_stored_columns(file.schema_arrow), file.metadata.num_rows)
            self.scalars = _schema_scalars(file.schema_arrow)
            self._names = file.schema_arrow.names

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        names = [self._names[column.key] for column in columns]
        # A column is read once, however often it is in `names`; batches have the file's order. With read-ahead the
        # whole file would be in memory at its end.
        with pq.ParquetFile(self.path, page_checksum_verification=True, pre_buffer=False) as file:
            for batch in file.iter_batches(max(rows, BATCH_ROWS_MIN), columns=names, use_threads=True):
                yield [_to_numpy(batch.column(name)) for name in names]


class ArrowRecording(Recording):
    """An Arrow IPC file or stream; the number of samples is known only after reading."""

    format: ClassVar[str] = "arrow"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as file:
            self._is_file = file.read(len(FILE_MAGIC)) == FILE_MAGIC
        with self._opened(None) as reader:
            self.columns, self.skipped = columns_of(_stored_columns(reader.schema), None)
            self.scalars = _schema_scalars(reader.schema)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        del rows  # batches are as the writer cut them
        required = sorted({column.key for column in columns})
        places = [required.index(column.key) for column in columns]
        with self._opened(required) as reader:
            for batch in _batches(reader):
                if batch.num_rows:
                    yield [_to_numpy(batch.column(place)) for place in places]

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


def _batches(reader: pa.ipc.RecordBatchFileReader | pa.ipc.RecordBatchStreamReader) -> Iterator[pa.RecordBatch]:
    if isinstance(reader, pa.ipc.RecordBatchStreamReader):
        yield from reader
    else:
        for at in range(reader.num_record_batches):
            yield reader.get_batch(at)


def _stored_columns(schema: pa.Schema) -> list[StoredColumn]:
    """The columns of a schema."""
    return [StoredColumn(one.name, _content_of(one.type), str(one.type), _texts(one.metadata)) for one in schema]


def _schema_scalars(schema: pa.Schema) -> dict[str, float]:
    """Numbers in the metadata of a schema."""
    return scalars_of(_texts(schema.metadata).items())


def _content_of(kind: pa.DataType) -> Content:
    """What a column of this type has."""
    if _is_time(kind):
        return Content.TIME
    return Content.NUMBER if _is_number(kind) else Content.OTHER


def _to_numpy(array: pa.Array[Any]) -> NDArray[Any]:
    """Values of an Arrow array; without a copy where it has no nulls. Nulls become NaN."""
    array.validate(full=True)
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    if _is_time(array.type):
        factor = _NANOSECONDS[array.type.unit]
        return tables.to_numpy(array.view(pa.int64())) * factor
    if pa.types.is_decimal(array.type):
        array = array.cast(pa.float64())
    if pa.types.is_boolean(array.type):
        array = array.cast(pa.uint8())
    return tables.to_numpy(array)


def _is_time(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _is_number(kind: pa.DataType) -> bool:
    types = pa.types
    return bool(
        types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_decimal(kind)
    ) or bool(types.is_dictionary(kind) and _is_number(kind.value_type))


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in (metadata or {}).items()}
