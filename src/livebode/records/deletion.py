"""Delete a run so that it can be restored: it is moved aside, within its own directory of runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

from livebode.core import RecordError, move_directory, remove_empty, sync_directory, writing
from livebode.records.inside import is_folder
from livebode.records.segments.lock import Lock
from livebode.records.summary_file import is_run

DELETED = ".deleted"
"""Name of the directory of the deleted runs, beside the other runs."""


def delete(run: Path) -> Path:
    """Move the directory of a run into `.deleted/DATE` beside it; return its new place.

    To restore it, move it back. The space on the disk is free only when it is removed from there.

    Raises
    ------
    RecordError
        If a process records in it, it is not the directory of a run, or it cannot be moved.
    """
    if not is_folder(run) or not is_run(run):
        raise RecordError(
            "not-a-run",
            f"{str(run)!r} is not the directory of a run",
            "give the directory of a run",
            path=str(run),
        )
    bin_ = run.parent / DELETED
    with writing(run, RecordError), _locked(run):
        bin_.mkdir(exist_ok=True)
        if not is_folder(bin_):
            raise NotADirectoryError(f"{DELETED} is not a directory")
        place = _dated(bin_)
        try:
            to = move_directory(run, place)
        except OSError:
            remove_empty(place)
            raise
        sync_directory(bin_)
    return to


def _dated(bin_: Path) -> Path:
    """A new directory: runs of one name may be deleted one after the other."""
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H%M%SZ")
    for n in count(1):
        place = bin_ / (now + f"-{n}" * (n > 1))
        with suppress(FileExistsError):
            place.mkdir()
            return place
    raise AssertionError


@contextmanager
def _locked(run: Path) -> Iterator[None]:
    """Keep other processes from recording in it meanwhile."""
    lock = Lock(run)
    try:
        yield
    finally:
        lock.release()
