"""Outbox: events that wait for delivery, in a file beside the run."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import sqlite3
import stat
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from livebode.core import PublishError, remove_files
from livebode.publishing.messages import EventMessage, read_event

WAITING_MAX = 10_000
"""Events that wait for one receiver; of more, the oldest are removed and counted."""
INTAKE_MAX = 4096
"""Events that wait to be written to the file."""
_RETRY_S = 1.0
_MARK = 0x6C624F42
"""The application of the database in its header: the letters lbOB."""
_TABLE = """CREATE TABLE IF NOT EXISTS events (
    number INTEGER PRIMARY KEY AUTOINCREMENT, sink TEXT NOT NULL, id TEXT NOT NULL, axis TEXT NOT NULL,
    event TEXT NOT NULL, UNIQUE (sink, id))"""
_logger = logging.getLogger(__name__)
Row = tuple[str, EventMessage]


class Outbox:
    """Events that wait for delivery, in an SQLite database that survives a kill.

    `put` only appends to a queue in memory. A thread writes the queue to the file, usually within some milliseconds;
    an event in the file remains there until `remove`, or until `WAITING_MAX` newer ones wait for the same receiver.

    Parameters
    ----------
    path
        The file; it is removed by `close` if nothing waits.
    stored
        Called in the thread of the outbox with the names of receivers for which events were written.

    Raises
    ------
    PublishError
        If the file cannot be opened.
    """

    def __init__(self, path: Path, stored: Callable[[set[str]], None]) -> None:
        self.path, self._stored = path, stored
        self.dropped: Counter[tuple[str, str]] = Counter()
        """Events that were not delivered because too many waited: receiver and axis."""
        self._queue: queue.Queue[Row | None] = queue.Queue(INTAKE_MAX)
        self._lock = threading.Lock()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if os.path.lexists(path) and not stat.S_ISREG(os.lstat(path).st_mode):
                raise _foreign(path)
            self._database = sqlite3.connect(path, check_same_thread=False)
            if not self._verified():
                raise _foreign(path)
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = FULL")
            with self._database:
                self._database.execute(_TABLE)
        except (OSError, sqlite3.Error) as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
                raise _foreign(path) from None
            raise PublishError(
                "outbox-unusable",
                f"the file {str(path)!r} for events that wait for delivery cannot be used: {error}",
                "check the permissions and the disk",
                path=str(path),
            ) from None
        self._thread = threading.Thread(target=self._work, name="livebode outbox", daemon=True)
        self._thread.start()

    def _verified(self) -> bool:
        """Whether the database is new or livebode's; `close` would remove another one."""
        (tables,) = self._database.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
        (mark,) = self._database.execute("PRAGMA application_id").fetchone()
        if not tables:
            self._database.execute(f"PRAGMA application_id = {_MARK}")
        return not tables or mark == _MARK

    def put(self, sink: str, event: EventMessage) -> None:
        """Take an event for a receiver, without waiting."""
        try:
            self._queue.put_nowait((sink, event))
        except queue.Full:
            self.dropped[sink, event.axis] += 1

    def oldest(self, sink: str, count: int) -> list[tuple[int, EventMessage]]:
        """The oldest events that wait for a receiver, each with its number."""
        with self._lock:
            rows = self._database.execute(
                "SELECT number, event FROM events WHERE sink = ? ORDER BY number LIMIT ?", (sink, count)
            ).fetchall()
        return [(number, read_event(event)) for number, event in rows]

    def remove(self, numbers: Sequence[int]) -> None:
        """Remove events that were delivered."""
        with self._lock, self._database:
            self._database.executemany("DELETE FROM events WHERE number = ?", [(number,) for number in numbers])

    def waiting(self, sink: str) -> dict[str, int]:
        """Number of events that wait for a receiver, by axis."""
        with self._lock:
            rows = self._database.execute("SELECT axis, COUNT(*) FROM events WHERE sink = ? GROUP BY axis", (sink,))
            return dict(rows.fetchall())

    def flush(self) -> None:
        """Write everything that was taken; no event is written after that."""
        self._queue.put(None)
        self._thread.join()

    def close(self) -> None:
        """Close the file after `flush`; it is removed if nothing waits."""
        with self._lock:
            (left,) = self._database.execute("SELECT COUNT(*) FROM events").fetchone()
            self._database.close()
        if not left:
            remove_files(self.path.parent.resolve(), [self.path.name])

    def _work(self) -> None:
        while True:
            rows = [self._queue.get()]
            with contextlib.suppress(queue.Empty):
                while True:
                    rows.append(self._queue.get_nowait())
            taken = [row for row in rows if row is not None]
            if taken:
                self._store(taken, last=None in rows)
            if None in rows:
                return

    def _store(self, rows: Sequence[Row], *, last: bool) -> None:
        """Write them; again after a pause while the disk is full, except at the end."""
        while True:
            try:
                self._write(rows)
                break
            except sqlite3.Error as error:
                _logger.warning("events that wait for delivery cannot be written to %s: %s", self.path, error)
                if last:
                    self.dropped.update((sink, event.axis) for sink, event in rows)
                    return
                threading.Event().wait(_RETRY_S)
        self._stored({sink for sink, _ in rows})

    def _write(self, rows: Sequence[Row]) -> None:
        with self._lock, self._database:
            self._database.executemany(
                "INSERT OR IGNORE INTO events (sink, id, axis, event) VALUES (?, ?, ?, ?)",
                [(sink, event.id, event.axis, event.stored()) for sink, event in rows],
            )
            for sink in {sink for sink, _ in rows}:
                removed = self._database.execute(
                    "DELETE FROM events WHERE number IN (SELECT number FROM events WHERE sink = ? "
                    "ORDER BY number DESC LIMIT -1 OFFSET ?) RETURNING axis",
                    (sink, WAITING_MAX),
                ).fetchall()
                self.dropped.update((sink, axis) for (axis,) in removed)


def _foreign(path: Path) -> PublishError:
    return PublishError(
        "outbox-foreign",
        f"{str(path)!r}, the file for events that wait for delivery, was written by another program",
        "move it away",
        path=str(path),
    )
