"""Damaged Parquet, whose pages have checksums: the same rows or one sentence, in little memory."""

from __future__ import annotations

import io
import random
import tracemalloc

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.tables.parquet_file import ParquetFile
from livebode.tables.thrift_compact import BINARY, I32, I64, LIST, STRUCT, binary, integer, list_of, struct_of
from tests.support.damaged_bytes import damaged

ROWS = 40
RNG = np.random.default_rng(1)
TABLE = pa.table({
    "sample": np.arange(ROWS), "u": RNG.standard_normal(ROWS), "s": [f"w{k % 3}" for k in range(ROWS)],
    "f": [None if k % 3 else 0.5 for k in range(ROWS)], "l": [[1.0] * (k % 3) for k in range(ROWS)],
})  # fmt: skip


def whole(**layout: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(TABLE, sink, row_group_size=25, write_page_checksum=True, **layout)
    return sink.getvalue()


def rows(data: bytes) -> pa.Table | None:
    """What is read; None if it is refused in one sentence."""
    try:
        batches = list(ParquetFile(io.BytesIO(data)).batches())
    except ValueError as error:
        sentence = str(error)
    else:
        return pa.Table.from_batches([pa.record_batch(batch) for batch in batches]) if batches else TABLE.slice(0, 0)
    assert 0 < len(sentence) < 300
    assert "\n" not in sentence
    return None


@pytest.mark.parametrize("layout", [{"compression": "zstd"}, {"compression": "none", "data_page_version": "2.0"}])
def test_a_wrong_byte_in_a_page_is_refused(layout):
    """Of the page headers, which have no checksum, a wrong byte can be in a value that no reader uses."""
    data, read, refused = whole(**layout), 0, 0
    end = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    for at in range(4, end, 4):
        found = rows(data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :])
        assert found is None or found.equals(TABLE), at
        read, refused = read + (found is not None), refused + (found is None)
    assert refused > read / 2


def test_a_file_cut_anywhere_is_refused():
    data = whole()
    assert all(rows(data[:size]) is None for size in range(0, len(data), 3))
    assert all(rows(data[size:]) is None for size in range(1, len(data) // 2, 7))


def test_a_damaged_footer_is_read_or_refused():
    """A wrong name or unit remains; no wrong value appears among the rows of a column."""
    data = whole()
    begin = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    refused = 0
    for seed in range(600):
        footer = damaged(data[begin:-8], random.Random(seed))
        found = rows(data[:begin] + footer + len(footer).to_bytes(4, "little") + b"PAR1")
        refused += found is None
    assert refused > 120


SCHEMA = list_of(STRUCT, [
    struct_of((4, BINARY, binary(b"schema")), (5, I32, integer(1))),
    struct_of((1, I32, integer(5)), (3, I32, integer(0)), (4, BINARY, binary(b"u"))),
])  # fmt: skip
FOOTERS = {
    "lists in lists": b"\x59" * 100_000 + b"\x00",
    "structs in structs": b"\x5c" * 100_000,
    "a long number": b"\x15" + b"\xff" * 100_000,
    "a list of 2**40": b"\x19\xfc" + b"\x80" * 5 + b"\x40",
    "text of 2**60 bytes": b"\x18" + b"\x80" * 8 + b"\x10",
    "empty structs": b"\x19\xfc\xa0\x8d\x06" + b"\0" * 100_000,
    "columns in columns": struct_of((2, LIST, list_of(STRUCT, [struct_of((5, I32, integer(1)))] * 5000))),
    "rows without bytes": struct_of(
        (2, LIST, SCHEMA),
        (3, I64, integer(1 << 40)),
        (4, LIST, list_of(STRUCT, [struct_of((3, I64, integer(1 << 40)))])),
    ),
    "2**31 columns": struct_of((2, LIST, list_of(STRUCT, [struct_of((5, I32, integer((1 << 31) - 1)))]))),
}


@pytest.mark.parametrize("name", FOOTERS)
def test_a_hostile_footer_is_refused_in_little_memory(name):
    data = b"PAR1" + FOOTERS[name] + len(FOOTERS[name]).to_bytes(4, "little") + b"PAR1"
    tracemalloc.start()
    assert rows(data) is None
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10_000_000 + 400 * len(data)


@pytest.mark.parametrize("length", [1 << 31, (1 << 32) - 1, 1000])
def test_a_footer_longer_than_the_file_is_refused(length):
    assert rows(b"PAR1" + bytes(100) + length.to_bytes(4, "little") + b"PAR1") is None
