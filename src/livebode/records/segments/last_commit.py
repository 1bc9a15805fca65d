"""The newest commit of a run, read without a lock and without changing anything."""

from __future__ import annotations

from pathlib import Path

from livebode.records.segments import journal
from livebode.records.segments.journal import Commit, Journal


def last_commit(run: Path) -> Commit | None:
    """Commit from which an unfinished run in this directory is continued, as in `recover`; None if there is none."""
    newest = [Journal.read(run, number).commit for number in journal.numbers(run)[-2:]]
    return max((commit for commit in newest if commit is not None), key=lambda commit: commit.position, default=None)
