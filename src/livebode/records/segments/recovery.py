"""Where an unfinished run is gone on with: the last commit that is whole, and everything before it."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from livebode.nouns import InputError
from livebode.records.segments import journal, manifest
from livebode.records.segments.journal import Commit, Journal
from livebode.records.segments.manifest import Manifest
from livebode.records.segments.shelf import sweep

RUN, EVENTS = "run.json", "events.jsonl"


@dataclass(frozen=True)
class Found:
    """What a run left.

    `number` and `length` are those of the journal that is gone on with, up to its last commit; `sealed` are the
    numbers of complete ones before it; `torn_bytes` were being written, behind the commit, when the run ended.
    """

    manifest: Manifest
    number: int
    length: int
    commit: Commit
    sealed: list[int]
    torn_bytes: int


def recover(run: Path) -> Found | None:
    """What to go on from; None where no run was begun in this directory.

    Raises
    ------
    InputError
        If it holds something else, or a run that is finished, or one whose journal is damaged.
    OSError
        If it cannot be read.
    """
    if not (run / RUN).exists():
        _clear(run)
        return None
    if not (run / manifest.NAME).exists() or json.loads((run / RUN).read_text("utf-8"))["record"]["finished"]:
        raise InputError(f"the run in {str(run)!r} is finished; take another --out, or --force to replace it")
    found = Manifest.read(run)
    found.check(run, journal.numbers(run), finished=False)
    sweep(run, found)
    left = [number for number in journal.numbers(run) if number not in found.closed]
    while left:
        number = left.pop()
        read = Journal.read(journal.path_of(run, number))
        before = Journal.read(journal.path_of(run, left[-1])).commit if left else None
        if read.commit is None or (before is not None and before.position > read.commit.position):
            # It was begun, but what came after went to the one before it.
            os.unlink(journal.path_of(run, number))
            continue
        torn = journal.path_of(run, number).stat().st_size - read.length
        torn += max(0, (run / EVENTS).stat().st_size - read.commit.events_bytes)
        return Found(found, number, read.length, read.commit, left, torn)
    raise InputError(f"the run in {str(run)!r} has no whole journal left to go on from; take another --out")


def _clear(run: Path) -> None:
    """Take away what a run left that was killed while it was begun; InputError where anything else is there."""
    ours = {manifest.NAME, EVENTS, journal.FOLDER, f".{RUN}.partial"}
    if strange := sorted(path.name for path in run.iterdir() if path.name not in ours):
        raise InputError(f"{str(run)!r} holds {strange[0]!r} and no run; take another --out")
    shutil.rmtree(run / journal.FOLDER, ignore_errors=True)
    for name in ours - {journal.FOLDER}:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(run / name)
