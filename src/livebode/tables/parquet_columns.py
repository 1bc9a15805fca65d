"""The values of a column as Parquet's pages have them: plain, or a dictionary and its numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.tables.parquet_format import (
    BOOLEAN,
    DATA_PAGE,
    DICTIONARY_PAGE,
    FORMS,
    PLAIN,
    RLE_DICTIONARY,
)  # fmt: skip
from livebode.tables.table import Column
from livebode.tables.text import Text
from livebode.tables.thrift_compact import unsigned

_PAGE_ROWS = 1 << 17  # 1 MiB of doubles
_Buffer = bytes | memoryview


class Page(NamedTuple):
    """A page before its compression."""

    kind: int
    values: int
    encoding: int
    data: _Buffer


class Bounds(NamedTuple):
    """Least and greatest value as bytes; None without a number."""

    minimum: bytes | None
    maximum: bytes | None


def encoded(column: Column, kind: str, *, repeating: bool) -> tuple[list[Page], Bounds]:
    """The pages of a column with at least one row; with a dictionary if it is text, or `repeating` and it is shorter.

    Numbers are not copied.
    """
    if isinstance(column, Text):
        used, at = _used(column)
        words = [word.encode() for word in used]
        dictionary = b"".join(len(word).to_bytes(4, "little") + word for word in words)
        return _coded(dictionary, len(words), at), Bounds(min(words), max(words))
    form = FORMS[kind]
    if form.physical == BOOLEAN:
        bits = [np.packbits(part, bitorder="little").data for part in _parts(column)]
        pages = [Page(DATA_PAGE, min(_PAGE_ROWS, len(column) - k * _PAGE_ROWS), PLAIN, b) for k, b in enumerate(bits)]
        return pages, Bounds(column.all().tobytes(), column.any().tobytes())
    values = np.ascontiguousarray(column, form.dtype)
    if repeating and (found := _dictionary_of(values)) is not None:
        words_of, at = found
        return _coded(words_of.data.cast("B"), len(words_of), at), _bounds(words_of)
    return [Page(DATA_PAGE, len(part), PLAIN, part.data.cast("B")) for part in _parts(values)], _bounds(values)


def _parts(values: NDArray[Any]) -> Iterator[NDArray[Any]]:
    for begin in range(0, len(values), _PAGE_ROWS):
        yield values[begin : begin + _PAGE_ROWS]


def _coded(dictionary: _Buffer, words: int, at: NDArray[np.integer[Any]]) -> list[Page]:
    """Numbers of words take whole bytes each: they compress better than those that take single bits."""
    width = 1 if words <= 1 << 8 else 2 if words <= 1 << 16 else 4
    codes = at.astype(f"<u{width}")
    pages = [Page(DICTIONARY_PAGE, words, PLAIN, dictionary)]
    for part in _parts(codes):
        head = bytes([8 * width]) + unsigned(-(-len(part) // 8) << 1 | 1)
        data = b"".join((head, part.data, bytes(-len(part) % 8 * width)))
        pages.append(Page(DATA_PAGE, len(part), RLE_DICTIONARY, data))
    return pages


def _dictionary_of(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.integer[Any]]] | None:
    """Different values, by their bits, and their numbers in the rows; None if most differ."""
    bits = values.view(f"i{values.itemsize}")
    begins = np.concatenate(([0], np.flatnonzero(bits[1:] != bits[:-1]) + 1))
    if 2 * len(begins) <= len(bits):  # over the lines of a response
        words, at = np.unique(bits[begins], return_inverse=True)
        at = np.repeat(at, np.diff(begins, append=len(bits)))
    elif 2 * (period := _period(bits)) <= len(bits):  # over responses
        words, at = np.unique(bits[:period], return_inverse=True)
        at = np.tile(at, -(-len(bits) // period))[: len(bits)]
    else:
        words = np.unique(bits)
        if 2 * len(words) > len(bits):
            return None
        at = np.searchsorted(words, bits)
    return words.view(values.dtype), at


def _period(bits: NDArray[Any]) -> int:
    """The number of values after which all come again."""
    if len(bits) < 2:
        return len(bits)
    again = int(np.argmax(bits[1:] == bits[0])) + 1
    return again if np.array_equal(bits[again:], bits[:-again]) else len(bits)


def _used(column: Text) -> tuple[list[str], NDArray[np.integer[Any]]]:
    """The words that are in a row, and their numbers."""
    found = np.bincount(column.at, minlength=len(column.words)) > 0
    return [word for word, used in zip(column.words, found) if used], (np.cumsum(found) - 1)[column.at]


def _bounds(values: NDArray[Any]) -> Bounds:
    if values.dtype.kind != "f":
        return Bounds(values.min().tobytes(), values.max().tobytes())
    low, high = values.min(), values.max()
    if np.isnan(low):
        low, high = np.fmin.reduce(values), np.fmax.reduce(values)  # slower, without the NaN
    if np.isnan(low):
        return Bounds(None, None)
    zero = values.dtype.type(0)  # Parquet demands that a bound of zero includes both signs
    return Bounds((low if low else -zero).tobytes(), (high if high else zero).tobytes())
