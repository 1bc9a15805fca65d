"""Rows of text as columns of numbers and back, in C; `livebode.sources.delimited` and `repr` define the values."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.kernel import _native

SKIPPED, NUMBER, MOMENT = range(3)
"""What a cell of a column contains."""
NO_MOMENT = int(np.iinfo(np.int64).min)
_NUMBER_BYTES = 32
_POWER_FIRST, _POWER_LAST = -342, 324


class TableLayout(NamedTuple):
    """How the rows of a table are read.

    Attributes
    ----------
    kinds
        SKIPPED, NUMBER or MOMENT for each cell of a row.
    empty
        Words that mean "no value", each followed by a zero byte.
    row_bytes_max
        A longer row is not read.
    delimiter, decimal, quote
        Their ASCII codes; quote 0: none.
    has_zone
        Whether moments end with a time zone.
    """

    kinds: bytes
    empty: bytes
    row_bytes_max: int
    delimiter: int
    decimal: int
    quote: int
    has_zone: bool


def read_rows(
    layout: TableLayout, text: bytes, begin: int, out: npt.NDArray[np.float64], filled: int
) -> tuple[int, int]:
    r"""Read plain rows of `text` from byte `begin` into `out`, until it is full or a row is not plain.

    Such a row may be valid: it has a number of more than 19 digits between two doubles, or quotes within a number.

    Parameters
    ----------
    out
        Shape (columns that are not skipped, rows). A moment is an int64 in place of the double: nanoseconds since
        1970, NO_MOMENT if missing.
    filled
        Rows that `out` has already.

    Returns
    -------
    tuple
        The rows that `out` has then, and the byte at which the next row begins.

    Examples
    --------
    >>> out = np.empty((2, 10))
    >>> layout = TableLayout(bytes([NUMBER, SKIPPED, NUMBER]), b"NA\0", 100, ord(","), ord("."), ord('"'), False)
    >>> read_rows(layout, b"1.5,a,2\n-1e3,b,NA\n1,2\n", 0, out, 0)
    (2, 18)
    >>> out[:, :2].tolist()
    [[1.5, -1000.0], [2.0, nan]]
    """
    return _native.read_rows(_powers(), layout, text, begin, out, filled)


class Words(NamedTuple):
    """A column of text: row i has the word number `at[i]`; a word is written as it is."""

    words: Sequence[bytes]
    at: npt.NDArray[np.int64]


def write_rows(columns: Sequence[npt.NDArray[np.float64] | npt.NDArray[np.int64] | Words]) -> memoryview:
    """Rows of comma-separated values; a number is the shortest decimal that gives the same double.

    Parameters
    ----------
    columns
        Contiguous, of one length.

    Examples
    --------
    >>> bytes(write_rows([np.array([0.1, 1e-7]), np.array([2, 3]), Words([b"a", b"b"], np.array([1, 0]))]))
    b'0.1,2,b\\n1e-7,3,a\\n'
    """
    words: list[bytes] = []
    arrays = []
    for column in columns:
        arrays.append(column.at + len(words) if isinstance(column, Words) else column)
        words += column.words if isinstance(column, Words) else ()
    is_words = bytes(isinstance(column, Words) for column in columns)
    ends = np.cumsum([0, *map(len, words)], dtype=np.int64)
    longest = max(_NUMBER_BYTES, *map(len, words), 0) + 1
    out = np.empty(len(arrays[0]) * len(arrays) * longest, np.uint8)
    length = _native.write_rows(_powers(), tuple(arrays), (is_words, b"".join(words), ends), out)
    return out.data[:length]


@cache
def _powers() -> npt.NDArray[np.uint64]:
    """The first 128 bits of each power of ten, shape (powers, 2); rounded down, and below 1 rounded up."""
    return np.array([_halves(q) for q in range(_POWER_FIRST, _POWER_LAST + 1)], dtype=np.uint64)


def _halves(q: int) -> tuple[int, int]:
    five: int = 5 ** abs(q)
    bits = five << 128 >> five.bit_length() if q >= 0 else (1 << 127 + five.bit_length()) // five + 1
    return bits >> 64, bits & (2**64 - 1)
