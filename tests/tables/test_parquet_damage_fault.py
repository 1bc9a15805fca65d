"""Damaged Parquet, whose pages have checksums: the same rows or one sentence, in little memory."""

from __future__ import annotations

import io
import random
import tracemalloc

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.tables import ParquetFile, Table
from livebode.tables.thrift_compact import BINARY, I32, I64, LIST, STRUCT, binary, integer, list_of, struct_of
from tests.support.damaged_bytes import damaged

ROWS = 40
RNG = np.random.default_rng(1)
TABLE = pa.table({
    "sample": np.arange(ROWS), "u": RNG.standard_normal(ROWS), "s": [f"w{k % 3}" for k in range(ROWS)],
    "f": [None if k % 3 else 0.5 for k in range(ROWS)], "l": [k // 9 for k in range(ROWS)],
})  # fmt: skip

WHOLE = Table.from_arrow(TABLE)


def whole(**layout: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(TABLE, sink, row_group_size=25, write_page_checksum=True, **layout)
    return sink.getvalue()


def rows(data: bytes) -> Table | None:
    """What is read; None if it is refused in one sentence."""
    try:
        return ParquetFile(data).table()
    except (ValueError, TypeError) as error:
        sentence = str(error)
    assert 0 < len(sentence) < 300
    assert "\n" not in sentence
    return None


@pytest.mark.parametrize("layout", [{"compression": "lz4"}, {"compression": "none", "use_dictionary": False}])
def test_a_wrong_byte_in_a_page_is_refused(layout):
    """Of the page headers, which have no checksum, a wrong byte can be in a value that no reader uses."""
    data, read, refused = whole(**layout), 0, 0
    end = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    for at in range(4, end):
        found = rows(data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :])
        assert found is None or found.equals(WHOLE), at
        read, refused = read + (found is not None), refused + (found is None)
    assert refused > read / 2


def test_a_file_cut_anywhere_is_refused():
    data = whole(compression="lz4")
    assert all(rows(data[:size]) is None for size in range(0, len(data), 3))
    assert all(rows(data[size:]) is None for size in range(1, len(data) // 2, 7))


def test_a_damaged_footer_is_read_or_refused():
    """A wrong name or unit remains; no wrong value appears among the rows of a column."""
    data = whole(compression="lz4")
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


def of_one_page(values: int, header: bytes, body: bytes, codec: int) -> bytes:
    """A file of a column "u" of doubles with these bytes as its pages."""
    pages = header + body
    about = struct_of(
        (1, I32, integer(5)), (2, LIST, list_of(I32, [integer(0)])), (3, LIST, list_of(BINARY, [binary(b"u")])),
        (4, I32, integer(codec)), (5, I64, integer(values)), (6, I64, integer(len(pages))),
        (7, I64, integer(len(pages))), (9, I64, integer(4)),
    )  # fmt: skip
    group = struct_of(
        (1, LIST, list_of(STRUCT, [struct_of((2, I64, integer(4)), (3, STRUCT, about))])), (3, I64, integer(values))
    )
    footer = struct_of((2, LIST, SCHEMA), (3, I64, integer(values)), (4, LIST, list_of(STRUCT, [group])))
    return b"PAR1" + pages + footer + len(footer).to_bytes(4, "little") + b"PAR1"


def data_page(values: int, size: int, stored: int, encoding: int = 0) -> bytes:
    about = struct_of(
        (1, I32, integer(values)), (2, I32, integer(encoding)), (3, I32, integer(3)), (4, I32, integer(3))
    )
    return struct_of((1, I32, integer(0)), (2, I32, integer(size)), (3, I32, integer(stored)), (5, STRUCT, about))


def dictionary_page(words: int, body: bytes) -> bytes:
    about = struct_of((1, I32, integer(words)), (2, I32, integer(0)))
    sizes = (2, I32, integer(len(body))), (3, I32, integer(len(body)))
    return struct_of((1, I32, integer(2)), *sizes, (7, STRUCT, about)) + body


WORD = dictionary_page(1, bytes(8))
MANY = 1 << 28
PAGES = {
    "2**28 values by a run": of_one_page(MANY, WORD + data_page(MANY, 7, 7, 8), b"\1" + b"\x80" * 4 + b"\4" + b"\0", 0),
    "a block that grows to 1 GiB": of_one_page(9, data_page(9, 1 << 30, 100), bytes(100), 7),
    "more bytes than values": of_one_page(9, data_page(9, 25000, 100), bytes(100), 7),
    "negative sizes": of_one_page(9, data_page(9, -1, -1), bytes(72), 0),
    "ten thousand empty pages": of_one_page(9, data_page(0, 0, 0) * 10_000, b"", 0),
    "a word that is not there": of_one_page(8, WORD + data_page(8, 3, 3, 8), b"\1\x10\1", 0),
    "no dictionary": of_one_page(8, data_page(8, 3, 3, 8), b"\1\x10\0", 0),
    "two dictionaries": of_one_page(8, WORD + WORD + data_page(8, 3, 3, 8), b"\1\x10\0", 0),
    "runs of nothing": of_one_page(8, WORD + data_page(8, 101, 101, 8), b"\1" + b"\0\0" * 50, 0),
}


def test_a_page_that_is_written_by_hand_is_read():
    found = rows(of_one_page(8, WORD + data_page(8, 3, 3, 8), b"\1\x10\0", 0))
    assert found is not None
    assert found["u"].tolist() == [0.0] * 8


@pytest.mark.parametrize("name", PAGES)
def test_a_hostile_page_is_refused_in_little_memory(name):
    tracemalloc.start()
    assert rows(PAGES[name]) is None
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10_000_000 + 10 * len(PAGES[name])
