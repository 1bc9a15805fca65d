"""State of a Tracker as bytes: named arrays, and a fingerprint of what they belong to."""

from __future__ import annotations

import hashlib
import io
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import UsageError

Arrays = dict[str, NDArray[np.generic]]


def pack(parts: dict[str, Arrays], owner: str) -> bytes:
    """Arrays of named parts as bytes, exact; `owner` says all that their meaning depends on."""
    flat: dict[str, Any] = {f"{part}/{name}": array for part, arrays in parts.items() for name, array in arrays.items()}
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, owner=_fingerprint(owner), **flat)
    return buffer.getvalue()


def unpack(data: bytes, owner: str) -> dict[str, Arrays]:
    """The parts again; UsageError where the bytes are damaged or belong to other settings."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as stored:
            flat = {name: stored[name] for name in stored.files}
        stored_owner = flat.pop("owner")
    except (ValueError, OSError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise UsageError(
            "unreadable", f"the snapshot of {len(data)} bytes is damaged ({error})", "start without it", argument="data"
        ) from None
    if not np.array_equal(stored_owner, _fingerprint(owner)):
        raise UsageError(
            "conflict",
            "the snapshot belongs to a tracker with other settings",
            "restore it into one with the same",
            argument="data",
        )
    parts: dict[str, Arrays] = {}
    for path, array in flat.items():
        part, name = path.split("/", 1)
        parts.setdefault(part, {})[name] = array
    return parts


def _fingerprint(owner: str) -> NDArray[np.uint8]:
    return np.frombuffer(hashlib.sha256(owner.encode()).digest(), dtype=np.uint8)
