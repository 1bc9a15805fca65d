"""Closing: journals become segments in a separate thread, so that tracking does not wait for it."""

from __future__ import annotations

import errno
import logging
import os
import threading
import time

from livebode.core import LivebodeError
from livebode.records.segments.manifest import Segment
from livebode.records.segments.merging import merged_bytes_max
from livebode.records.segments.shelf import Shelf

# One for all records of the process: sixteen axes that close a segment in the same second would use every core.
_ONE_AT_A_TIME = threading.Lock()
_USUAL_S = 2.0  # a conversion takes longer only where the disk is slow, or another record's is before it
_logger = logging.getLogger(__name__)


class Closing:
    """Applies the budget of a Shelf and closes its journals while recording continues.

    Nothing else may use the shelf between `begin` and the `result` or `wait` that follows.
    """

    def __init__(self, shelf: Shelf) -> None:
        self._shelf = shelf
        self._thread: threading.Thread | None = None
        self._began_s = 0.0
        self._gone: list[Segment] = []
        self._error: BaseException | None = None

    def ends(self) -> bool:
        """Whether no thread runs; one that has begun a short time ago is waited for."""
        if self._thread is not None:
            self._thread.join(max(0.0, self._began_s + _USUAL_S - time.monotonic()))
        return self._thread is None or self.done

    @property
    def done(self) -> bool:
        """Whether a thread has ended and its result was not read."""
        return self._thread is not None and not self._thread.is_alive()

    def begin(self, bytes_max: int | None) -> None:
        """Remove the oldest segments above `bytes_max`, then convert all sealed journals; see `result`."""
        assert self._thread is None
        self._began_s = time.monotonic()
        self._thread = threading.Thread(target=self._work, args=(bytes_max,), name="livebode closing")
        self._thread.start()

    def result(self) -> tuple[list[Segment], OSError | LivebodeError | None]:
        """Wait for the end: the removed segments, and why a journal could not be converted.

        That journal and later ones are tried again at the next `begin`.
        """
        self.wait()
        gone, error = self._gone, self._error
        self._gone, self._error = [], None
        if error is not None and not isinstance(error, OSError | LivebodeError):
            raise error
        return gone, error

    def wait(self) -> None:
        """Wait for the end, and ignore the result."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _merge(self, bytes_max: int | None) -> None:
        try:
            self._shelf.merge(merged_bytes_max(bytes_max))
            self._shelf.shorten()
        except OSError as error:  # everything is recorded, and merging is tried again when the next journal is closed
            _logger.warning("segments could not be merged: %s", error)

    def _work(self, bytes_max: int | None) -> None:
        try:
            with _ONE_AT_A_TIME:
                if bytes_max is not None:
                    self._gone = self._shelf.make_room(bytes_max)
                self._shelf.close_journals()
                self._merge(bytes_max)
        except MemoryError:
            self._error = OSError(errno.ENOMEM, os.strerror(errno.ENOMEM))
        except BaseException as error:  # it must not be lost with the thread
            self._error = error
