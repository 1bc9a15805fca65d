"""The definition of integers in runs: https://parquet.apache.org/docs/file-format/data-pages/encodings/ (RLE).

A head of seven bits a byte, the lowest first, says how many values follow: its lowest bit is 0 for one value that is
repeated, in whole bytes, and 1 for groups of eight values whose bits follow each other.
"""

from __future__ import annotations

_HEAD_BYTES_MAX = 5


def decode_runs(data: bytes, width: int, count: int) -> list[int]:
    """See `livebode.kernel.decode_runs`.

    >>> decode_runs(bytes([3 << 1, 5, 1 << 1 | 1, 0b10001000, 0b11000110, 0b11111010]), 3, 11)
    [5, 5, 5, 0, 1, 2, 3, 4, 5, 6, 7]
    """
    values: list[int] = []
    at = 0
    while len(values) < count:
        head, at = _head(data, at)
        run = head >> 1
        size = run * width if head & 1 else -(-width // 8)
        if size > len(data) - at:
            raise ValueError("a page is cut")
        bits = int.from_bytes(data[at : at + size], "little")
        at += size
        left = count - len(values)
        if head & 1:
            values += [bits >> k * width & (1 << width) - 1 for k in range(min(8 * run, left))]
        else:
            values += [bits] * min(run, left)
    return values


def _head(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for k, byte in enumerate(data[at : at + _HEAD_BYTES_MAX]):
        value |= (byte & 0x7F) << 7 * k
        if byte < 0x80:
            return value, at + k + 1
    raise ValueError("a page is cut")
