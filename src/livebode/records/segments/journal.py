"""The journal: everything recorded since the last segment was closed, with the state to continue from."""

from __future__ import annotations

import contextlib
import json
import math
import os
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from livebode.core import RecordError, replace_file, sync_directory
from livebode.dataclass import dataclass
from livebode.records.column_table import ColumnTable
from livebode.records.inside import check_folder, open_read
from livebode.records.json_format import check_version, format_of
from livebode.records.segments.damage import Damage
from livebode.records.segments.frames import COMMIT, FORMAT, ROWS, TABLE, Frame, frames, to_frame
from livebode.tables import Schema, Table, from_message, schema_from_message, schema_to_message

FOLDER, ASIDE = "open", "damaged"
_LENGTH = struct.Struct("<I")
_SPARSE_BYTES_MAX, _SPARSE_RATIO = 512 << 20, 16  # above them a file has holes, which a run never writes
_PLACE = "sample", "time_s", "unix_s", "events_bytes"


@dataclass(frozen=True)
class Commit:
    """A point up to which the record is complete.

    Attributes
    ----------
    sample, time_s
        Number of the next sample, which is not in the record yet, and its time in the source's clock.
    unix_s
        Time of writing, seconds since 1970.
    events_bytes
        Length of events.jsonl at that time.
    states
        States that continue from there, as named bytes.
    rows
        Number of rows of each table recorded since the run began.
    waiting
        Events as plain data that are not in events.jsonl yet, because they will share a line.
    """

    sample: int
    time_s: float
    unix_s: float
    events_bytes: int
    states: Mapping[str, bytes]
    rows: Mapping[str, int] = field(default_factory=dict)
    waiting: Sequence[Any] = ()

    @property
    def position(self) -> tuple[int, int]:
        """Quantities that grow from one commit to the next."""
        return self.sample, self.events_bytes

    def to_frame(self) -> bytes:
        head = {name: getattr(self, name) for name in (*_PLACE, "rows", "waiting")}
        text = json.dumps(head | {"states": {name: len(state) for name, state in self.states.items()}}).encode()
        return to_frame(COMMIT, _LENGTH.pack(len(text)), text, *self.states.values())

    @classmethod
    def of(cls, payload: memoryview) -> Commit:
        """The commit in this frame; ValueError, TypeError or KeyError if a run cannot have written it."""
        position = _LENGTH.size + _LENGTH.unpack_from(payload)[0]
        head = json.loads(bytes(payload[_LENGTH.size : position]))
        whole = [head["sample"], head["events_bytes"], *head["rows"].values()]
        if any(type(number) is not int for number in whole) or not all(map(math.isfinite, (head["time_s"], *whole))):
            raise ValueError("the commit is invalid")
        waiting = head.pop("waiting")
        if not isinstance(waiting, list):
            raise ValueError("the events are invalid")
        states = {}
        for name, length in head.pop("states").items():
            states[name] = bytes(payload[position : position + length])
            position += length
        return cls(**head, states=states, waiting=tuple(waiting))


@dataclass
class Journal:
    """Content of a journal up to its last commit; empty and without commit if there is none.

    Attributes
    ----------
    rows
        The rows of each table, in the parts that were written together.
    first, commit
        The first and the last one; the journal counts up to the end of the last.
    length
        Bytes up to there; later bytes were being written when the run ended.
    damages
        Damaged places.
    """

    rows: dict[str, list[Table]] = field(default_factory=dict)
    first: Commit | None = None
    commit: Commit | None = None
    length: int = 0
    damages: list[Damage] = field(default_factory=list)
    _behind: dict[str, list[Table]] = field(default_factory=dict)
    _broken_bytes: int = 0
    _counted: dict[str, list[Table]] | None = None

    @classmethod
    def read(cls, run: Path, number: int, after: Callable[[], Commit | None] = lambda: None) -> Journal:
        """A journal of a run.

        Parameters
        ----------
        run
            Directory of the run.
        number
            Number of the journal.
        after
            Called if the end is damaged: returns the commit with which the next journal begins, if there is one. It
            shows what the damaged end contained.

        Raises
        ------
        RecordError
            If its frames are intact, but their content is not from a run, or a newer livebode wrote it.
        OSError
            If it cannot be read.
        """
        sequence = list(frames(_whole(run, name_of(number))))
        _check_version(run / name_of(number), sequence)
        try:
            return cls()._over(iter(sequence), after)
        except (ValueError, KeyError, TypeError, RecursionError, struct.error):
            raise RecordError(
                "unexpected-content",
                f"{str(run / name_of(number))!r} has invalid content",
                "move it away",
                path=str(run / name_of(number)),
            ) from None

    def _over(self, sequence: Iterator[Frame], after: Callable[[], Commit | None]) -> Journal:
        tables: dict[int, tuple[str, Schema]] = {}
        for frame in sequence:
            if frame.payload is None or (frame.kind == ROWS and frame.table not in tables):
                # After a damaged commit there are only rows of one that was still being written.
                first = not self._broken_bytes
                self._broken_bytes += frame.end - frame.start
                if first and frame.kind == COMMIT:
                    self._counted = {name: list(batches) for name, batches in self._behind.items()}
                else:
                    self._counted = None
            elif frame.kind == TABLE:
                named, _, layout = bytes(frame.payload).partition(b"\0")
                tables[frame.table] = named.decode(), schema_from_message(layout)
            elif frame.kind == ROWS:
                name, schema = tables[frame.table]
                self._behind.setdefault(name, []).append(from_message(frame.payload, schema))
            elif frame.kind == COMMIT:
                self._reach(Commit.of(frame.payload), frame.end)
        if self._broken_bytes:
            self._end(after())
        return self

    def _reach(self, commit: Commit, end: int) -> None:
        if self._broken_bytes:
            self._damaged(commit)
        for name, batches in self._behind.items():
            self.rows.setdefault(name, []).extend(batches)
        self._behind.clear()
        self.first, self.commit, self.length = self.first or commit, commit, end

    def _end(self, after: Commit | None) -> None:
        if after is not None and (self.commit is None or after.position > self.commit.position):
            self._reach(after, self.length)
        else:
            self._damaged(None)

    def _damaged(self, upto: Commit | None) -> None:
        since, rows = self.commit, dict[str, int]()
        if since is not None and upto is None:
            self.damages.append(self._end_damaged(since))
        else:
            if since is not None and upto is not None:
                whole = _count(self._behind)
                lost = {name: n - since.rows.get(name, 0) - whole.get(name, 0) for name, n in upto.rows.items()}
                rows = {name: n for name, n in lost.items() if n > 0}
            begin, end = (None if commit is None else (commit.sample, commit.time_s) for commit in (since, upto))
            self.damages.append(Damage(self._broken_bytes, begin, end, rows))
        self._broken_bytes = 0

    def _end_damaged(self, since: Commit) -> Damage:
        """What is lost after the last intact commit: intact rows, and the content of the damaged bytes.

        If only the commit is damaged, the intact rows are all.
        """
        known = self._behind if self._counted is None else self._counted
        begin = since.sample, since.time_s
        last = [batch["sample"].max() for batches in known.values() for batch in batches if batch.num_rows]
        if not last:
            return Damage(self._broken_bytes, begin, None)
        end = 1 + int(max(last))
        first = self.first or since
        passed = since.sample - first.sample
        step_s = (since.time_s - first.time_s) / passed if passed else 0.0
        place = begin, (end, since.time_s + (end - since.sample) * step_s)
        return Damage(self._broken_bytes, *place, _count(known), at_least=self._counted is None)


def _whole(run: Path, name: str) -> bytes:
    """Content of a journal, whose size has no limit while no segment can be closed; RecordError for one with holes.

    Memory is at most proportional to the bytes on the disk, because a journal is untrusted data.
    """
    with open_read(run, name) as file:
        about = os.fstat(file.fileno())
        held_bytes = 512 * getattr(about, "st_blocks", 0)
        if about.st_size > max(_SPARSE_BYTES_MAX, _SPARSE_RATIO * held_bytes):
            raise RecordError(
                "too-large",
                f"{str(run / name)!r} is {about.st_size} bytes long, but only {held_bytes} are on the disk; a run "
                "does not write that",
                "move it away",
                path=str(run / name),
                size_bytes=about.st_size,
                held_bytes=held_bytes,
            )
        return file.read(about.st_size)


def _check_version(path: Path, sequence: list[Frame]) -> None:
    for frame in sequence:
        if frame.kind == FORMAT and frame.payload is not None:
            with contextlib.suppress(json.JSONDecodeError, UnicodeDecodeError, AttributeError, RecursionError):
                check_version(path, "journal", json.loads(bytes(frame.payload)).get("version"))


def _count(batches: Mapping[str, list[Table]]) -> dict[str, int]:
    return {name: sum(batch.num_rows for batch in of) for name, of in batches.items()}


def head(tables: Mapping[str, ColumnTable], commit: Commit) -> bytes:
    """Beginning of a journal: its format, names and schemas of its tables, and the commit from which it continues.

    It is written twice, because nothing after a damaged schema could be read.
    """
    schemas = [
        to_frame(TABLE, name.encode() + b"\0", schema_to_message(table.schema), table=number)
        for number, (name, table) in enumerate(tables.items())
    ]
    begin = to_frame(FORMAT, json.dumps(format_of("journal")).encode())
    return b"".join([begin, *schemas, commit.to_frame()] * 2)


def read_sealed(run: Path, number: int) -> Journal:
    """A complete journal; if its end is damaged, the next one shows what it contained."""

    def after() -> Commit | None:
        return Journal.read(run, number + 1).first if number + 1 in numbers(run) else None

    return Journal.read(run, number, after)


def set_aside(run: Path, number: int) -> None:
    """Move a damaged journal out of the folder of journals."""
    check_folder(run, set_aside_name(number))
    with contextlib.suppress(FileExistsError):
        os.mkdir(run / ASIDE)
    replace_file(run / name_of(number), run / set_aside_name(number))
    sync_directory(run / ASIDE)


def name_of(number: int) -> str:
    """Path of a journal in the run's directory."""
    return f"{FOLDER}/{number:06d}.journal"


def set_aside_name(number: int) -> str:
    return f"{ASIDE}/{number:06d}.journal"


def numbers(run: Path) -> list[int]:
    """Numbers of the existing journals, ascending."""
    check_folder(run, name_of(1))
    names = {path.name for path in (run / FOLDER).glob("*.journal") if path.stem.isdecimal() and path.stem.isascii()}
    ascending = sorted(int(name.removesuffix(".journal")) for name in names if len(name) < 20)
    return [number for number in ascending if Path(name_of(number)).name in names]


def last_commit(run: Path) -> Commit | None:
    """Commit from which an unfinished run in this directory is continued, as in `recover`; None if there is none."""
    newest = [Journal.read(run, number).commit for number in numbers(run)[-2:]]
    return max((commit for commit in newest if commit is not None), key=lambda commit: commit.position, default=None)
