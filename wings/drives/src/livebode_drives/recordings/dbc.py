"""The DBC file that defines the signals in CAN frames: read by cantools, after a check of the sizes in it."""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

from livebode.core import RecordingError
from livebode.sources import contained, missing, oversized

DBC_BYTES_MAX = 1 << 26
SIZE = re.compile(rb"(?:\bBO_\s+\d+\s+\w+\s*:\s*|\bSG_[^:\n]*:\s*|\|)(\d+)(?=\s+\w|[|@])")
BYTES_MAX = 4096
"""Longest message; J1939 has 1785 bytes."""


def messages_of(dbc: Path | None, path: Path) -> dict[tuple[int, bool], Any]:
    """Messages of `dbc` by identifier and whether it is extended; RecordingError if `path` has no DBC."""
    try:
        import cantools
    except ImportError:
        raise missing(path, "cantools", "can") from None
    if dbc is None:
        raise RecordingError(
            "dbc-missing",
            f"{path} contains CAN frames, whose signals only a DBC file defines",
            "set dbc to the file that defines them",
            path=str(path),
            argument="dbc",
        )
    if not dbc.is_file():
        raise RecordingError("not-found", f"there is no DBC file {dbc}", "check the name", path=str(dbc))
    logging.getLogger("cantools").setLevel(logging.CRITICAL)  # its messages are in the error that follows
    with contained(dbc, "DBC"):
        check_sizes(dbc)
        # Signals that overlap are usual in files of manufacturers, and cantools refuses them by default.
        database = cantools.database.can.Database(strict=False)
        database.add_dbc_file(dbc)
    return {(message.frame_id, message.is_extended_frame): message for message in database.messages}


def check_sizes(dbc: Path) -> None:
    """RecordingError for a message or signal whose size would fill the memory: cantools builds a mask of its bits."""
    if dbc.stat().st_size > DBC_BYTES_MAX:
        raise oversized(f"{dbc} has more than {DBC_BYTES_MAX} bytes", DBC_BYTES_MAX)
    for size in SIZE.findall(dbc.read_bytes()):
        if len(size) > 5 or int(size) > 8 * BYTES_MAX:
            raise oversized(f"{dbc} has a message or signal of size {size[:20].decode()}", 8 * BYTES_MAX)
