"""Reading Parquet through arro3 with the house's footers, beside PyArrow: `python -m bench.decisions.parquet`.

Processor time in milliseconds of one thread, the least of several rounds; both read to NumPy columns.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.records.response_table import SCHEMA
from livebode.tables.parquet_file import ParquetFile
from livebode.tables.parquet_footer import read_footer

ROUNDS, LINES = 9, 13


def file_of(table: pa.Table, rows: int, codec: str) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table, sink, row_group_size=rows, compression=codec)
    return sink.getvalue()


def responses(rows: int) -> bytes:
    """A segment of responses: seven columns repeat over the lines of a response."""
    rng = np.random.default_rng(1)
    values = {"int64": np.repeat(np.arange(rows // LINES), LINES), "bool": np.ones(rows, bool)}
    columns = {one.name: values.get(one.kind, rng.standard_normal(rows)) for one in SCHEMA}
    return file_of(pa.table(columns), rows, "lz4")


def samples(rows: int) -> bytes:
    rng = np.random.default_rng(1)
    columns = {"t": np.arange(rows) / 4000, **{name: rng.standard_normal(rows) for name in "uwyx"}}
    return file_of(pa.table(columns), rows // 10, "zstd")


def by_pyarrow(data: bytes, names: Sequence[str] | None = None, groups: Sequence[int] | None = None) -> None:
    file = pq.ParquetFile(pa.BufferReader(data))
    numbers = range(file.num_row_groups) if groups is None else groups
    for column in file.read_row_groups(numbers, names, use_threads=False).columns:
        column.to_numpy()


def by_arro3(data: bytes, places: Sequence[int] | None = None, groups: Sequence[int] | None = None) -> None:
    for batch in ParquetFile(io.BytesIO(data)).batches(places, groups, 1 << 20):
        for at in range(batch.num_columns):
            batch.column(at).to_numpy()


def least_ms(action: Callable[[], object]) -> float:
    found = []
    for _ in range(ROUNDS):
        began = time.process_time()
        action()
        found.append(time.process_time() - began)
    return 1e3 * min(found)


def main() -> None:
    """Print the table."""
    log, small, large = samples(1_000_000), responses(40 * LINES), responses(2520 * LINES)
    cases: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
        "1e6 samples, all": (lambda: by_pyarrow(log), lambda: by_arro3(log)),
        "one column of five": (lambda: by_pyarrow(log, ["y"]), lambda: by_arro3(log, [3])),
        "one row group of ten": (lambda: by_pyarrow(log, None, [5]), lambda: by_arro3(log, None, [5])),
        "40 responses": (lambda: by_pyarrow(small), lambda: by_arro3(small)),
        "2,520 responses": (lambda: by_pyarrow(large), lambda: by_arro3(large)),
        "footer of 50 column chunks": (
            lambda: pq.read_metadata(pa.BufferReader(log)),
            lambda: read_footer(io.BytesIO(log)),
        ),
    }
    print(f"{'':28}{'PyArrow':>10}{'arro3':>10}{'ratio':>8}")
    for name, (theirs, ours) in cases.items():
        both = least_ms(theirs), least_ms(ours)
        print(f"{name:28}{both[0]:10.2f}{both[1]:10.2f}{both[1] / both[0]:8.2f}", flush=True)


if __name__ == "__main__":
    main()
