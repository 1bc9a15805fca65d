"""Bytes with faults in them, and what an error about them must be."""

from __future__ import annotations

import json
import random

from livebode.core import LivebodeError

ODD = [0, 1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1]


def damaged(raw: bytes, rng: random.Random) -> bytes:
    """A few bytes or numbers changed, removed or inserted."""
    out = bytearray(raw)
    for _ in range(rng.choice([1, 1, 2, 5])):
        at = rng.randrange(len(out)) if out else 0
        what = rng.randrange(5)
        if what == 0:
            out[at : at + 1] = rng.randbytes(1)
        elif what == 1 and out:
            out[at] ^= 1 << rng.randrange(8)
        elif what == 2:
            size = rng.choice([1, 2, 4, 8])
            out[at : at + size] = (rng.choice(ODD) % 256**size).to_bytes(size, "little")
        elif what == 3:
            del out[at : at + rng.randrange(1, 20)]
        else:
            out[at:at] = rng.randbytes(rng.randrange(1, 9))
    return bytes(out)


def one_sentence(error: LivebodeError) -> None:
    """That an error is short, in one line, and has facts that are plain data."""
    assert error.message
    json.dumps(error.as_dict())
    assert "\n" not in str(error)
    assert len(str(error)) < 1000
