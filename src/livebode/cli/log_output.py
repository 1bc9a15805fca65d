"""The program's log: one line for each record, on standard error or in a file."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from livebode.cli.frames import visible
from livebode.core import not_written

LOGGER = "livebode"


class LineFormatter(logging.Formatter):
    """UTC time, level, logger and message in one line without control characters.

    >>> record = logging.LogRecord("livebode.sources.live.mqtt", logging.INFO, "", 0, "a\\nb\\x1b[2J", None, None)
    >>> record.created = 0.25
    >>> LineFormatter().format(record)
    '1970-01-01T00:00:00.250000Z INFO livebode.sources.live.mqtt: a\\\\nb\\\\u001b[2J'
    """

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: ARG002, N802
        """The record's time in ISO format."""
        microseconds = round(record.created * 1e6)
        seconds, rest = divmod(microseconds, 1_000_000)
        return f"{time.strftime('%Y-%m-%dT%H:%M:%S', time.gmtime(seconds))}.{rest:06d}Z"

    def format(self, record: logging.LogRecord) -> str:
        """All of the record, a traceback too, in one line."""
        text = super().format(record)
        return visible(text.replace("\n", "\\n").replace("\t", "\\t"))


class _StderrHandler(logging.StreamHandler):  # type: ignore[type-arg]
    """Standard error as it is at the moment: a live table stands in for it while it is shown."""

    def emit(self, record: logging.LogRecord) -> None:
        self.stream = sys.stderr
        super().emit(record)


@contextmanager
def log_output(level: str | None, file: Path | None) -> Iterator[None]:
    """Within, what livebode logs from this level on goes to the file, else to standard error.

    With a file alone the level is info; with neither nothing is written.

    Raises
    ------
    OutputError
        If the file cannot be opened.
    """
    if level is None and file is None:
        yield
        return
    handler = _StderrHandler() if file is None else _opened(file)
    handler.setFormatter(LineFormatter())
    logger = logging.getLogger(LOGGER)
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel((level or "info").upper())
    try:
        yield
    finally:
        logger.setLevel(before)
        logger.removeHandler(handler)
        handler.close()


@contextmanager
def warnings_shown() -> Iterator[None]:
    """Within, what livebode logs as a warning goes to standard error, if no log was asked for."""
    asked_for = any(not isinstance(handler, logging.NullHandler) for handler in logging.getLogger(LOGGER).handlers)
    with log_output(None if asked_for else "warning", None):
        yield


def _opened(file: Path) -> logging.Handler:
    from livebode.cli.log_file import LogFile  # loads the sockets of other handlers

    try:
        return LogFile(file)
    except OSError as error:
        raise not_written(file, error, unchanged=False) from None
