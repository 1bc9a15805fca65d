"""Runs of small integers in Parquet's pages: which rows have a value, and the numbers of words of a dictionary."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_WIDTH_MAX = 32
_BYTES = {8: "<u1", 16: "<u2", 32: "<u4"}
Integers = NDArray[np.unsignedinteger[Any]]


def decoded(data: memoryview, width: int, count: int) -> Integers:
    """So many integers of `width` bits, each run of equal ones once, or packed eight at a time.

    Raises
    ------
    ValueError
        If the bytes have fewer, or the width is more than 32.
    """
    if width > _WIDTH_MAX:
        raise ValueError(f"its integers have {width} bits")
    values: list[int] = []
    counts: list[int] = []
    packed: list[memoryview] = []
    size, at, left = -(-width // 8), 0, count
    while left > 0:
        head, at = _unsigned(data, at)
        if head & 1:
            end, run = at + (head >> 1) * width, head >> 1 << 3
            packed.append(data[at:end])
            values.append(-1)
        else:
            end, run = at + size, head >> 1
            values.append(int.from_bytes(data[at:end], "little"))
        if end > len(data):
            raise ValueError("a page is cut")
        counts.append(min(run, left))
        at, left = end, left - run
    return _joined(values, counts, packed, width, count)


def _joined(values: list[int], counts: list[int], packed: list[memoryview], width: int, count: int) -> Integers:
    if values == [-1]:
        return _unpacked(packed[0], width)[:count]
    run_of = np.array(values, dtype=np.int64)
    found = np.repeat(run_of, counts)
    if packed:
        is_packed = np.repeat(run_of < 0, counts)
        found[is_packed] = _unpacked(b"".join(packed), width)[: np.count_nonzero(is_packed)]
    return found.astype(np.uint32)


def _unpacked(data: bytes | memoryview, width: int) -> Integers:
    if width in _BYTES:
        return np.frombuffer(data, _BYTES[width])
    if width == 1:
        return np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
    groups = len(data) // width if width else 0
    padded = bytes(data) + bytes(8)
    found = np.empty((groups, 8), dtype=np.uint32)
    for place in range(8):  # of each eight values, from the eight bytes in which the value is
        byte, bit = divmod(place * width, 8)
        window: NDArray[np.uint64] = np.ndarray((groups,), "<u8", padded, byte, (width,))
        found[:, place] = window >> np.uint64(bit) & np.uint64((1 << width) - 1)
    return found.reshape(-1)


def _unsigned(data: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    for byte in data[at : at + 5]:
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
    raise ValueError("a page is cut")
