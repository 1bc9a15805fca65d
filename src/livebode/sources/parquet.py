"""Parquet: livebode's own files are read by its own reader, those of other programs by PyArrow (extra `parquet`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from livebode.sources.columnar import Content, StoredColumn, columns_of, scalars_of
from livebode.sources.extras import missing
from livebode.sources.recording import Chunk, Column, Recording, check_packed
from livebode.tables import STRING, WRITER, ParquetFile

_END_BYTES = 1 << 16  # a footer ends with its writer, and three bytes for each column


class ParquetRecording(Recording):
    """A Parquet file that livebode wrote, read one row group after the other; `samples` is in its footer."""

    format: ClassVar[str] = "parquet"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as content:
            file = ParquetFile(content)
            schema, rows = file.schema, file.footer.rows
        stored = [
            StoredColumn(one.name, Content.OTHER if one.kind == STRING else Content.NUMBER, one.kind, one.metadata)
            for one in schema
        ]
        check_packed(path, rows * len(stored))
        self.columns, self.skipped = columns_of(stored, rows)
        self.scalars = scalars_of(schema.metadata.items())
        self._names = schema.names

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        del rows  # a row group has so few that it is in memory as a whole
        names = [self._names[column.key] for column in columns]
        with self.path.open("rb") as content:
            file = ParquetFile(content)
            for group in range(len(file.footer.groups)):
                table = file.table([group], list(dict.fromkeys(names)))
                yield [table[name] for name in names]


def open_parquet(path: Path) -> Recording:
    """The recording in a Parquet file.

    Raises
    ------
    ExtraError
        If another program wrote it, and PyArrow is not installed.
    """
    if _is_own(path):
        return ParquetRecording(path)
    try:
        from livebode.sources.pyarrow_files import ForeignParquetRecording
    except ModuleNotFoundError as error:
        raise missing(path, "pyarrow", "parquet") from error
    return ForeignParquetRecording(path)


def _is_own(path: Path) -> bool:
    with path.open("rb") as content:
        content.seek(max(0, path.stat().st_size - _END_BYTES))
        if WRITER.encode() not in content.read():  # a footer of thousands of columns takes seconds to read
            return False
        try:
            return ParquetFile(content).footer.writer == WRITER
        except ValueError:  # PyArrow reads more forms of a footer, and states what is wrong with it
            return False
