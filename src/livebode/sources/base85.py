"""The base-85 text in which Siemens controls store arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import InputError

ALPHABET = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
ZEROS = b"."
"""Stands for four zero bytes."""
VALUES = np.full(256, 255, np.uint8)
VALUES[np.frombuffer(ALPHABET, np.uint8)] = np.arange(85)
WEIGHTS = 85 ** np.arange(4, -1, -1, dtype=np.int64)


def decode(text: str) -> NDArray[np.float64]:
    """Big-endian doubles from text, five characters for four bytes; white space does not count.

    >>> decode(" ........ ")
    array([0., 0., 0., 0.])

    Raises
    ------
    InputError
        For a character outside the alphabet, a group above 2³²−1, or a length that is no whole number of doubles.
    """
    raw = "".join(text.split()).encode("ascii", "replace").replace(ZEROS, b"00000")
    values = VALUES[np.frombuffer(raw, np.uint8)]
    if (bad := np.flatnonzero(values == 255)).size:
        raise InputError(f"character {chr(raw[int(bad[0])])!r} is not base-85 text; is the file damaged?")
    if len(values) % 10:
        raise InputError(f"{len(values)} characters of base-85 text are no whole number of values; is the file whole?")
    words = values.reshape(-1, 5).astype(np.int64) @ WEIGHTS
    if words.size and int(words.max()) > 0xFFFFFFFF:
        raise InputError("a group of base-85 text is above 4294967295; is the file damaged?")
    return words.astype(">u4").view(">f8").astype(np.float64)
