"""Free space where runs are written, and how long the disk takes to make data safe."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

from livebode.core import why
from livebode.doctor.check import Check
from livebode.records import SegmentLimits

NAME = "disk"
FREE_BYTES_MIN = 10**9
"""Below this much a warning is due."""
SYNC_S_MAX = SegmentLimits.interval_s
"""A record is synced this often; a slower disk loses more at a power cut."""
_PIECE_BYTES, _SYNCS = 64 << 10, 5


def check_disk(directory: Path, budget_bytes: int | None = None) -> Check:
    """The file system of a directory, which need not exist yet; `budget_bytes` is what a record there may take."""
    place = directory.absolute()
    while not place.is_dir() and place != place.parent:
        place = place.parent
    needed = max(FREE_BYTES_MIN, budget_bytes or 0)
    try:
        free = shutil.disk_usage(place).free
        sync_s = _sync_s(place)
    except OSError as error:
        remedy = "free some space, check its permissions, or write runs to another directory"
        return Check(NAME, "failed", f"{place} cannot be written: {why(error)}", remedy, {"path": str(place)})
    message = f"{free / 1e9:.3g} GB free in {place}; a sync takes {1e3 * sync_s:.3g} ms (longest of {_SYNCS})"
    facts = {"path": str(place), "free_bytes": free, "sync_s": sync_s}
    if free < needed:
        remedy = f"free some space; {needed / 1e9:.3g} GB or more are recommended"
        return Check(NAME, "warning", message, remedy, facts)
    if sync_s > SYNC_S_MAX:
        remedy = f"take a faster disk; a record is synced every {SYNC_S_MAX:g} s"
        return Check(NAME, "warning", message, remedy, facts)
    return Check(NAME, "ok", message, facts=facts)


def _sync_s(place: Path) -> float:
    """The longest of some appended and synced pieces, in a file without a name."""
    piece, longest = bytes(_PIECE_BYTES), 0.0
    with tempfile.TemporaryFile(dir=place, buffering=0) as file:
        for _ in range(_SYNCS):
            began = time.perf_counter()
            rest = memoryview(piece)
            while rest:
                rest = rest[file.write(rest) :]
            os.fsync(file.fileno())
            longest = max(longest, time.perf_counter() - began)
    return longest
