"""Integers in runs of a Parquet file, in C; `tests/twins/runs.py` defines them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from livebode.kernel import _native

_WIDTH_MAX = 32


def decode_runs(data: bytes | memoryview, width: int, count: int) -> npt.NDArray[np.uint32]:
    """So many integers of `width` bits, in runs of equal ones, or packed eight at a time.

    Raises
    ------
    ValueError
        If the bytes have fewer, or the width is more than 32.

    Examples
    --------
    >>> decode_runs(bytes([3 << 1, 5, 1 << 1 | 1, 0b10001000, 0b11000110, 0b11111010]), 3, 11).tolist()
    [5, 5, 5, 0, 1, 2, 3, 4, 5, 6, 7]
    """
    if width > _WIDTH_MAX:
        raise ValueError(f"its integers have {width} bits")
    out = np.empty(count, np.uint32)
    if not _native.decode_runs(data, width, out):
        raise ValueError("a page is cut")
    return out
