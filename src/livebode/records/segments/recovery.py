"""Where an unfinished run is gone on with: the last commit that is whole, and everything before it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from livebode.core import RecordError
from livebode.records.removal import foreign, remove
from livebode.records.segments import journal, manifest
from livebode.records.segments.journal import Commit, Journal
from livebode.records.segments.manifest import Manifest
from livebode.records.segments.shelf import sweep
from livebode.records.summary_file import RUN, read_summary

EVENTS = "events.jsonl"


@dataclass(frozen=True)
class Found:
    """What a run left.

    `commit` is the last one that is whole. The run goes on in journal `number`, up to `length`; where that is None, in
    a new one. `sealed` are the numbers of those to be closed, complete or damaged; `torn_bytes` were being written,
    behind the commit, when the run ended.
    """

    manifest: Manifest
    number: int
    length: int | None
    commit: Commit
    sealed: list[int]
    torn_bytes: int


def recover(run: Path) -> Found | None:
    """What to go on from; None where no run was begun in this directory.

    Raises
    ------
    RecordError
        If it holds something else, or a run that is finished, or one that has no whole commit.
    OSError
        If it cannot be read.
    """
    if not os.path.lexists(run / RUN):
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
    found = Manifest.read(run)
    found.check(run, journal.numbers(run))
    sweep(run, found)
    left = [number for number in journal.numbers(run) if number not in found.closed]
    damaged: list[int] = []
    while left:
        number = left.pop()
        read = Journal.read(run, number)
        before = journal.read_sealed(run, left[-1]).commit if left else None
        if read.commit is None or (before is not None and before.position > read.commit.position):
            if read.damages:
                damaged.insert(0, number)
            else:  # It was begun, but what came after went to the one before it.
                os.unlink(run / journal.name_of(number))
            continue
        torn = (run / journal.name_of(number)).stat().st_size - read.length
        torn += max(0, (run / EVENTS).stat().st_size - read.commit.events_bytes)
        if damaged or read.damages:
            sealed = [*left, number, *damaged]
            return Found(found, sealed[-1] + 1, None, read.commit, sealed, torn)
        return Found(found, number, read.length, read.commit, left, torn)
    raise RecordError(
        "not-continuable",
        f"the run in {str(run)!r} has no whole journal left to continue from",
        "choose another path",
        path=str(run),
    )


def _clear(run: Path) -> None:
    """Take away what a run left that was killed while it was begun; RecordError where anything else is there."""
    ours = {manifest.NAME, EVENTS, journal.FOLDER, f".{RUN}.partial"}
    if strange := sorted({path.name for path in run.iterdir()} - ours) or foreign(run):
        raise RecordError(
            "foreign-files",
            f"{str(run)!r} holds {strange[0]!r} and no run",
            "choose another path",
            path=str(run),
            files=strange,
        )
    remove(run, itself=False)
