"""The parts of a Parquet file for run.json, from its own metadata: what `records.table_file` notes while it writes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.records.table_file import ParquetPart, sha256_of_next


def parts_of(path: Path) -> list[dict[str, Any]]:
    """The row groups and the end of the file, with their checksums."""
    import pyarrow.parquet as pq

    with path.open("rb") as file:
        about = pq.read_metadata(file)
        groups = [about.row_group(number) for number in range(about.num_row_groups)]
        ends = [max(_end(group.column(k)) for k in range(group.num_columns)) for group in groups]
        rows = [group.num_rows for group in groups]
        file.seek(0)
        sizes = [end - begin for begin, end in zip([0, *ends], [*ends, path.stat().st_size])]
        return [asdict(ParquetPart(n, size, sha256_of_next(file, size))) for n, size in zip([*rows, 0], sizes)]


def _end(column: Any) -> int:
    begin = column.data_page_offset
    if column.has_dictionary_page:
        begin = min(begin, column.dictionary_page_offset)
    return int(begin + column.total_compressed_size)
