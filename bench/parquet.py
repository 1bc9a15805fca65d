"""The Parquet files of runs, written and read by livebode and by PyArrow: `python -m bench.parquet`.

Processor time in milliseconds of one thread, the least of several rounds, and livebode's relative to PyArrow's. Both
read all columns to NumPy arrays, from memory. PyArrow wrote the files of earlier runs.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.records import RESPONSE_SCHEMA, RESPONSES
from livebode.tables import ParquetFile, ParquetWriter, Table, read_footer

ROUNDS, LINES, HOP, RATE_HZ = 15, 13, 20, 4000.0
COUNTS = 1, 40, 2520
"""Responses in a file."""


def responses(count: int) -> Table:
    """Rows as a run records them: what is known of a response repeats over its lines."""
    rng = np.random.default_rng(1)
    sample = np.repeat(np.arange(count) * HOP, LINES)
    rows = len(sample)
    known = {
        "first": sample,
        "sample": sample + 400,
        "time_s": sample / RATE_HZ,
        "schedule": np.zeros(rows),
        "frequency_hz": np.tile(np.arange(1.0, LINES + 1) * 10, count),
        "dof": np.full(rows, 6.0),
        "valid": np.ones(rows, bool),
        "ready": np.ones(rows, bool),
    }
    columns = (known[name] if name in known else rng.standard_normal(rows) for name in RESPONSE_SCHEMA.names)
    return Table(RESPONSE_SCHEMA, tuple(columns))


def samples(rows: int) -> Table:
    """A recording, for a footer of many columns in row groups."""
    rng = np.random.default_rng(1)
    return Table.of({"t": np.arange(rows) / RATE_HZ, **{name: rng.standard_normal(rows) for name in "uwyx"}})


def written(table: Table) -> bytes:
    sink = io.BytesIO()
    writer = ParquetWriter(sink, table.schema, RESPONSES.repeating)
    writer.write(table)
    writer.close()
    return sink.getvalue()


def written_by_pyarrow(table: pa.Table, group_rows: int | None = None) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table, sink, row_group_size=group_rows, compression="lz4")
    return sink.getvalue()


def read_by_pyarrow(data: bytes) -> None:
    for column in pq.ParquetFile(pa.BufferReader(data)).read(use_threads=False).columns:
        column.to_numpy()


def least_ms(first: Callable[[], object], second: Callable[[], object]) -> tuple[float, float]:
    """Of both, in turn."""
    found = []
    for _ in range(ROUNDS):
        times = [time.thread_time()]
        for action in (first, second):
            action()
            times.append(time.thread_time())
        found.append(np.diff(times))
    ours, theirs = 1e3 * np.min(found, axis=0)
    return ours, theirs


def main() -> None:
    """Print the table."""
    print("| | livebode, ms | PyArrow, ms | ratio |\n|---|---:|---:|---:|")

    def compare(what: str, ours: Callable[[], object], theirs: Callable[[], object]) -> None:
        both = least_ms(ours, theirs)
        print(f"| {what} | {both[0]:.2f} | {both[1]:.2f} | {both[0] / both[1]:.2f} |", flush=True)

    for count in COUNTS:
        table = responses(count)
        arrow = pa.table(table)
        own, foreign = written(table), written_by_pyarrow(arrow)
        name = f"{count:,} response{'s' if count > 1 else ''}"
        compare(f"write {name}", lambda t=table: written(t), lambda t=arrow: written_by_pyarrow(t))
        compare(f"read {name}", lambda d=own: ParquetFile(d).table(), lambda d=own: read_by_pyarrow(d))
        compare(
            f"read {name} that PyArrow wrote",
            lambda d=foreign: ParquetFile(d).table(),
            lambda d=foreign: read_by_pyarrow(d),
        )
    recording = written_by_pyarrow(pa.table(samples(1_000_000)), 100_000)
    compare(
        "read a footer of 50 column chunks",
        lambda: read_footer(io.BytesIO(recording)),
        lambda: pq.read_metadata(pa.BufferReader(recording)),
    )


if __name__ == "__main__":
    main()
