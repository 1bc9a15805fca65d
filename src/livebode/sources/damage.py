"""The errors of all readers: a file is damaged, ends early, or is larger than a recording can be."""

from __future__ import annotations

from pathlib import Path

from livebode.core import RecordingError
from livebode.tables import PACKED_MAX


def damaged(message: str, **facts: object) -> RecordingError:
    """The error for content that contradicts its format."""
    return RecordingError("damaged", message, "copy or export the file again", **facts)


def truncated(message: str, **facts: object) -> RecordingError:
    """The error for a file that ends before its content does."""
    return RecordingError("truncated", message, "check that the file was copied completely", **facts)


def oversized(message: str, limit: int, **facts: object) -> RecordingError:
    """The error for more columns, parts or bytes than are read."""
    return RecordingError("too-large", message, "check that this is a recording", limit=limit, **facts)


def check_packed(path: Path, values: int) -> None:
    """RecordingError if a file declares more numbers than any compression fits into it."""
    stored = path.stat().st_size
    if 8 * values > PACKED_MAX * stored:
        raise damaged(f"it declares {values} numbers in {stored} bytes", declared=values, size_bytes=stored)
