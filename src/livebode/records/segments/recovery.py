"""Where an unfinished run continues: the last intact commit, and everything before it."""

from __future__ import annotations

from pathlib import Path

from livebode.core import RecordError, remove_files
from livebode.dataclass import dataclass
from livebode.records.removal import foreign, remove
from livebode.records.segments import journal, manifest
from livebode.records.segments.journal import Commit, Journal
from livebode.records.segments.manifest import Manifest
from livebode.records.segments.shelf import sweep
from livebode.records.summary_file import RUN, is_run, read_summary

EVENTS = "events.jsonl"


@dataclass(frozen=True)
class UnfinishedRun:
    """State of an unfinished run.

    `commit` is the last intact one. The run continues in journal `number` after `length`; if that is None, in a new
    journal. `sealed` are the numbers of the journals to be closed, complete or damaged; `torn_bytes`, after the commit,
    were being written when the run ended.
    """

    manifest: Manifest
    number: int
    length: int | None
    commit: Commit
    sealed: list[int]
    torn_bytes: int


def recover(run: Path) -> UnfinishedRun | None:
    """State to continue from; None if no run was begun in this directory.

    Raises
    ------
    RecordError
        If it contains something else, or a finished run, or one without an intact commit.
    OSError
        If it cannot be read.
    """
    if not is_run(run):
        _clear(run)
        return None
    if not (run / manifest.NAME).exists() or read_summary(run)[0].get("record", {}).get("finished", True):
        raise RecordError(
            "finished",
            f"the run in {str(run)!r} is finished",
            "choose another path, or replace it with force",
            path=str(run),
            argument="force",
        )
    listed = Manifest.read(run)
    listed.check(run, journal.numbers(run))
    sweep(run, listed)
    left = [number for number in journal.numbers(run) if not listed.is_closed(number)]
    damaged: list[int] = []
    while left:
        number = left.pop()
        read = Journal.read(run, number)
        before = journal.read_sealed(run, left[-1]).commit if left else None
        if read.commit is None or (before is not None and before.position > read.commit.position):
            if read.damages:
                damaged.insert(0, number)
            else:  # It was begun, but later data went to the previous journal.
                remove_files(run / journal.FOLDER, [Path(journal.name_of(number)).name])
            continue
        torn = (run / journal.name_of(number)).stat().st_size - read.length
        torn += max(0, (run / EVENTS).stat().st_size - read.commit.events_bytes)
        if damaged or read.damages:
            sealed = [*left, number, *damaged]
            return UnfinishedRun(listed, sealed[-1] + 1, None, read.commit, sealed, torn)
        return UnfinishedRun(listed, number, read.length, read.commit, left, torn)
    raise RecordError(
        "not-continuable",
        f"the run in {str(run)!r} has no intact journal to continue from",
        "choose another path",
        path=str(run),
    )


def _clear(run: Path) -> None:
    """Remove the files of a run that was killed at its beginning; RecordError if there are any others."""
    ours = {manifest.NAME, EVENTS, journal.FOLDER, f".{RUN}.partial"}
    if strange := sorted({path.name for path in run.iterdir()} - ours) or foreign(run):
        raise RecordError(
            "foreign-files",
            f"{str(run)!r} contains {strange[0]!r} and no run",
            "choose another path",
            path=str(run),
            files=strange,
        )
    remove(run.resolve(), itself=False)
