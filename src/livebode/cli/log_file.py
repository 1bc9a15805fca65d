"""The file of --log-file."""

from __future__ import annotations

import logging
import sys
from logging.handlers import RotatingFileHandler
from pathlib import Path

FILE_BYTES_MAX = 16 << 20
"""A file that has so many bytes is renamed to NAME.1, in the place of the one before."""


class LogFile(RotatingFileHandler):
    """A file of bounded size. Lines that cannot be written are lost; standard error gets one sentence about it."""

    _failed = False

    def __init__(self, path: Path) -> None:
        super().__init__(path, maxBytes=FILE_BYTES_MAX, backupCount=1, encoding="utf-8", errors="backslashreplace")

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: ARG002, N802
        """Without a traceback for each line: the run is worth more than its log."""
        if not self._failed:
            self._failed = True
            print(f"livebode: the log file {self.baseFilename} cannot be written; lines are lost", file=sys.stderr)
