"""The base-85 text in which Siemens controls store arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.sources import damaged, truncated

ALPHABET = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
ZEROS = b"."
"""Code for four zero bytes."""
VALUES = np.full(256, 255, np.uint8)
VALUES[np.frombuffer(ALPHABET, np.uint8)] = np.arange(85)
WEIGHTS = 85 ** np.arange(4, -1, -1, dtype=np.int64)


def decode(text: str) -> NDArray[np.float64]:
    """Big-endian doubles from text, five characters for four bytes; white space is ignored.

    >>> decode(" ........ ")
    array([0., 0., 0., 0.])

    Raises
    ------
    RecordingError
        For a character outside the alphabet, a group above 2³²−1, or a length that is not a whole number of doubles.
    """
    raw = "".join(text.split()).encode("ascii", "replace").replace(ZEROS, b"00000")
    values = VALUES[np.frombuffer(raw, np.uint8)]
    if (bad := np.flatnonzero(values == 255)).size:
        character = chr(raw[int(bad[0])])
        raise damaged(f"character {character!r} is not base-85 text", character=character)
    if len(values) % 10:
        raise truncated(
            f"{len(values)} characters of base-85 text are not a whole number of values", length=len(values)
        )
    words = values.reshape(-1, 5).astype(np.int64) @ WEIGHTS
    if words.size and int(words.max()) > 0xFFFFFFFF:
        raise damaged("a group of base-85 text is above 4294967295")
    return words.astype(">u4").view(">f8").astype(np.float64)
