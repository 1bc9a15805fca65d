"""MDF files opened by asammdf, without its messages and without what it leaves behind after an error."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from livebode.sources import missing
from livebode_drives.recordings.silence import silence


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    try:
        from asammdf import MDF, mdf
        from asammdf.blocks import mdf_v3, mdf_v4, v4_blocks
    except ImportError:
        raise missing(path, "asammdf", "mdf") from None
    silence(mdf, mdf_v3, mdf_v4, v4_blocks)
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # its messages are in the error that follows
    with path.open("rb") as raw:  # a path would be mapped; if a mapped file shrinks, the process is killed
        try:
            file = MDF(raw)
        except Exception as error:
            abandon(error)
            raise
        try:
            yield file
        finally:
            file.close()


def abandon(error: Exception) -> None:
    """Close the incomplete object of asammdf, which would print on standard error when it is collected."""
    trace = error.__traceback__
    while trace is not None:
        half: Any = trace.tb_frame.f_locals.get("self")
        if hasattr(half, "_tempfile") and not getattr(half, "_closed", True):
            half._closed = True
            half._tempfile.close()
        trace = trace.tb_next
