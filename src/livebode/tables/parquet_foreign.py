"""Columns of a run that another program wrote again, in a form that livebode does not write: by PyArrow."""

from __future__ import annotations

import io
from typing import BinaryIO

from livebode.tables.table import Column, Table


def foreign_column(content: bytes | BinaryIO, group: int, name: str, rows: int, form: str) -> Column:
    """The values of a column in a row group with so many rows.

    Raises
    ------
    ValueError
        If PyArrow is not installed, or does not find a value for each row; it begins with `form`, a sentence.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        raise ValueError(f"{form}, which needs PyArrow: install livebode[parquet]") from None
    source = io.BytesIO(content) if isinstance(content, bytes) else content
    try:
        file = pq.ParquetFile(source, page_checksum_verification=True)
        found = Table.from_arrow(file.read_row_group(group, columns=[name], use_threads=False)).columns
    except (pa.ArrowException, OSError, TypeError) as error:
        raise ValueError(f"{form}, and PyArrow does not read it: {str(error).splitlines()[0]}") from None
    if len(found) != 1 or len(found[0]) != rows:
        raise ValueError(f"{form}, and has not one value for each row")
    return found[0]
