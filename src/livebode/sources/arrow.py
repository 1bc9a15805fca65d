"""Arrow IPC (extra `parquet`)."""

from __future__ import annotations

from pathlib import Path

from livebode.sources.extras import missing
from livebode.sources.recording import Recording


def open_arrow(path: Path) -> Recording:
    """The recording in an Arrow file; ExtraError if PyArrow is not installed."""
    try:
        from livebode.sources.pyarrow_files import ArrowRecording
    except ModuleNotFoundError as error:
        raise missing(path, "pyarrow", "parquet") from error
    return ArrowRecording(path)
