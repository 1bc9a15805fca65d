"""Frames of a fleet: the looks of all axes for the page, 4 bits each, or those that changed.

| byte | type | what |
|---|---|---|
| 0 | 4 bytes | `LBFT` |
| 4 | u8 | version, 1 |
| 5 | u8 | kind: 0 all, 1 changes |
| 8 | u32 | layout: the numbers of the axes belong to it |
| 12 | u32 | number of axes, or of changes |
| 16 | | all: a byte for two axes, the first in its low 4 bits; changes: u32 each, axis in the low 28 bits, look above |

Numbers are little endian.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

_HEADER = struct.Struct("<4sBBxxII")
_MAGIC, _VERSION, _ALL, _CHANGES = b"LBFT", 1, 0, 1
_AXIS_BITS = 28


def tiles_frame(layout: int, looks: np.ndarray[Any, Any], before: np.ndarray[Any, Any] | None) -> bytes:
    """What a page that shows `before` needs to show `looks`, in the shorter form; nothing if they are equal.

    >>> before = np.zeros(100_000, np.uint8)
    >>> after = before.copy()
    >>> after[70_000] = 3
    >>> len(tiles_frame(1, after, None)), len(tiles_frame(1, after, before)), len(tiles_frame(1, after, after))
    (50016, 20, 0)
    """
    if before is not None and len(before) == len(looks):
        changed = np.flatnonzero(looks != before)
        if not len(changed):
            return b""
        if 8 * len(changed) < len(looks):
            words = changed.astype("<u4") | (looks[changed].astype("<u4") << _AXIS_BITS)
            return _HEADER.pack(_MAGIC, _VERSION, _CHANGES, layout, len(changed)) + bytes(words.astype("<u4").tobytes())
    even = np.zeros(len(looks) + len(looks) % 2, np.uint8)
    even[: len(looks)] = looks
    pairs = even[::2] | (even[1::2] << 4)
    return _HEADER.pack(_MAGIC, _VERSION, _ALL, layout, len(looks)) + bytes(pairs.tobytes())
