"""Store: writes the record of a run so that a kill at any moment costs at most the last second."""

from __future__ import annotations

import contextlib
import logging
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from livebode.core import Emit, Event, LivebodeError, RecordError, ignore, sync_directory, why, write_whole, writing
from livebode.language import Message
from livebode.records.column_table import ColumnTable
from livebode.records.inside import check_own
from livebode.records.segments import journal, manifest
from livebode.records.segments.closing import Closing
from livebode.records.segments.damage import total
from livebode.records.segments.disk import AppendFile
from livebode.records.segments.event_lines import end_missing, ends_line
from livebode.records.segments.event_log import EventLog
from livebode.records.segments.journal import Commit
from livebode.records.segments.limits import JOURNALS, SegmentLimits
from livebode.records.segments.lock import Lock
from livebode.records.segments.manifest import Manifest
from livebode.records.segments.merging import merged_bytes_max
from livebode.records.segments.phase import Phase
from livebode.records.segments.recovery import EVENTS, UnfinishedRun, recover
from livebode.records.segments.shelf import Shelf, Tiers, no_tiers
from livebode.records.segments.syncing import Syncing
from livebode.records.segments.waiting import UnsyncedRows
from livebode.records.summary_file import COPY, RUN, to_document
from livebode.tables import Table

_NEARLY = 15 / 16  # of the bytes of a journal: the next commit may fill it
_logger = logging.getLogger(__name__)


class Store:
    """The record of one run, written by one process; see docs/reference/run-directory.md for its files.

    Use it as a context manager. Rows and events wait until `commit` writes them together with the state to continue
    from. Leaving the context writes nothing more, for any reason; `finish` does.

    A disk error pauses the record and raises nothing: `commit` tries again each time, and Events report the pause, its
    end, and what was lost.

    Parameters
    ----------
    path
        Directory of the run; created if it is missing.
    tables
        Tables by name.
    limits
        Sizes and budget.
    emit
        Receives the events of the record itself.
    tiers
        The tables of means of the rows of a journal, computed when it is closed.

    Attributes
    ----------
    last
        The commit to continue from, or the newest one, without its states; None in a new directory, in which `begin`
        starts a run.
    phase
        Part of an interval by which its commits and segments are ahead of those of another record of the process.

    Raises
    ------
    RecordError
        On entering: if another process records there, the directory has other content, or the run is finished or
        damaged.
    """

    def __init__(
        self,
        path: Path,
        tables: Mapping[str, ColumnTable],
        limits: SegmentLimits,
        emit: Emit = ignore,
        tiers: Tiers = no_tiers,
    ) -> None:
        self.path, self.limits = path, limits
        self.last: Commit | None = None
        self.phase = 0.0
        self._tables, self._tiers = dict(tables), tiers
        self._waiting = UnsyncedRows(tuple(self._tables))
        self._log = EventLog(path, emit)
        self._pause: Event | None = None
        self._attempts = 0  # failed attempts to close a segment since the last closed one
        self._synced_s = 0.0
        self._syncing = Syncing()

    def __enter__(self) -> Store:
        with self._writing(), contextlib.ExitStack() as files:
            self.path.mkdir(parents=True, exist_ok=True)
            files.callback(Lock(self.path).release)
            phase = Phase()
            files.callback(phase.release)
            self.phase = phase.part
            self._files = files
            unfinished = recover(self.path)
            if unfinished is not None:
                self._go_on(unfinished)
            self._files = files.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._files.close()

    def begin(self, summary: dict[str, Any], sample: int, time_s: float, states: Mapping[str, bytes]) -> None:
        """Start a run in the directory, with this run.json, at this sample; RecordError after a disk error."""
        commit = Commit(sample, time_s, time.time(), 0, dict(states))
        with self._writing():
            os.mkdir(self.path / journal.FOLDER)
            self._open_files(Manifest(), [], 0)
            self._shelf.begin()
            self._open_journal(1, commit)
            self._shorten_segment()
            self._files.callback(self._close_open_journal)
            self._write_summary(summary, finished=False)
            sync_directory(self.path.parent)
            self.last = commit
        _logger.info("%s: the record begins at sample %d", self.path, sample)

    def renew(self, summary: dict[str, Any]) -> None:
        """Write run.json for a run that continues: the results at its end were previous ones."""
        with self._writing():
            self._write_summary(summary, finished=False)

    def write(self, table: str, rows: Table) -> None:
        """Append rows to a table with the next commit."""
        self._waiting.add(table, rows)

    def write_event(self, event: Event) -> None:
        """Append an event with the next commit."""
        self._log.add(event)

    def commit(self, sample: int, time_s: float, states: Mapping[str, bytes], waiting: Sequence[Event] = ()) -> bool:
        """Record everything before this sample, with the states that continue from there.

        Events that are `waiting` for a line in events.jsonl are in the record until the next commit. Returns whether
        the commit was written.
        """
        committed_s = time.monotonic()
        self._waiting.gather()
        try:
            self._settle(self._syncing.done())
            self._log.write(self._events)
            plain = [asdict(event) for event in waiting]
            written = self._events.length, dict(states), dict(self._waiting.rows), plain
            commit = Commit(sample, time_s, time.time(), *written)
            self._journal.append(b"".join([*self._waiting.unwritten(), commit.to_frame()]))
            parts = self._waiting.written()
            full = self._full(sample) and self._may_close()
            if full:
                self._sync()
            elif committed_s - self._synced_s >= self.limits.interval_s:
                self._synced_s = committed_s
                self._syncing.begin(self._journal, parts)
            self.last = replace(commit, states={})  # some 100 kB for each axis of the process
        except OSError as error:
            self._failed(error, sample, time_s)
            return False
        self._go_on_after_pause(sample, time_s)
        if full:
            # Without space for it, the journal continues to grow, and this is tried again at the next commit.
            try:
                self._close_segment(commit)
            except (OSError, LivebodeError) as error:
                self._not_closed(error, Message("with the next commit"))
        elif self._closing.done:
            self._closed()
        return True

    def finish(self, summary: dict[str, Any], states: Mapping[str, bytes], *, finished: bool) -> None:
        """Close open files and write run.json; a run that is not `finished` can be continued later from `states`.

        These are the states of the last commit.

        Raises
        ------
        RecordError
            After a disk error; the record is then as after a kill.
        """
        with self._writing():
            assert self.last is not None
            self._not_paused()
            self._sync()
            self._close_segment(replace(self.last, states=dict(states)))
            if (error := self._closed()) is not None:
                raise error
            self.commit(self.last.sample, self.last.time_s, states)  # with the events of closing
            self._not_paused()
            self._write_summary(summary, finished=finished, ended=True)
            if finished:
                self._shelf.discard(journal.name_of(self._number))
        _logger.info("%s: the record ends, %s", self.path, "finished" if finished else "to be continued")

    def _writing(self) -> contextlib.AbstractContextManager[None]:
        return writing(self.path, RecordError, unchanged=False)

    def _not_paused(self) -> None:
        if self._pause is not None:
            raise RecordError(
                "not-written",
                f"the run in {str(self.path)!r} could not be finished: {self._pause.message}",
                "free some space, and continue the run",
                path=str(self.path),
                errno=self._pause.details.get("errno"),
            )

    def closes_at(self, sample: int) -> bool:
        """Whether a commit at this sample may close the segment, which waits for the disk; more often by its bytes."""
        return self._full(sample) or self._journal.length >= _NEARLY * self.limits.journal_bytes_max

    def _full(self, sample: int) -> bool:
        limits = self.limits
        return self._journal.length >= limits.journal_bytes_max or sample - self._began >= limits.segment_samples

    def _may_close(self) -> bool:
        """Whether the previous journal is converted, or this one may not grow: no commit waits for a slow disk."""
        return self._journal.length >= self.limits.journal_bytes_max or self._closing.ends()

    def _go_on(self, unfinished: UnfinishedRun) -> None:
        self.last = unfinished.commit
        self._waiting.rows |= unfinished.commit.rows
        self._open_files(unfinished.manifest, unfinished.sealed, unfinished.commit.events_bytes)
        if unfinished.length is None:
            self._open_journal(unfinished.number, unfinished.commit)
        else:
            self._journal = AppendFile(self.path, journal.name_of(unfinished.number), unfinished.length)
            self._number, self._safe_bytes = unfinished.number, unfinished.length
            self._began = unfinished.commit.sample
        self._shorten_segment()
        self._files.callback(self._close_open_journal)
        if unfinished.sealed:
            self._begin_closing()
        away_s = time.time() - unfinished.commit.unix_s
        pause = f"{away_s:.1f} s after it ended there"
        if away_s < 0:
            pause = (
                f"at a time {-away_s:.1f} s before it ended there: this computer's clock was set back, so "
                "the length of the pause is not known; check its date and time"
            )
        self._log.report(
            "record-continued",
            unfinished.commit.sample,
            unfinished.commit.time_s,
            f"the record continues at sample {unfinished.commit.sample}, {pause}",
            away_s=away_s if away_s >= 0 else None,
            torn_bytes=unfinished.torn_bytes,
        )

    def _open_files(self, listed: Manifest, sealed: list[int], events_bytes: int) -> None:
        self._shelf = Shelf(self.path, self._tables, listed, sealed, self._tiers)
        self._files.callback(self._shelf.close)
        self._closing = Closing(self._shelf)
        self._files.callback(self._closing.wait)
        self._named = len(listed.retained)
        self._events = AppendFile(self.path, EVENTS, events_bytes)
        self._files.callback(self._events.close)
        if self._events.length < events_bytes:
            assert self.last is not None
            lost_bytes = events_bytes - self._events.length
            self._log.report_event(end_missing(lost_bytes, self.last.sample, self.last.time_s))
        if self._events.length and not ends_line(self.path):
            self._events.append(b"\n")  # so that only the damaged line is lost

    def _write_summary(self, summary: dict[str, Any], *, finished: bool, ended: bool = False) -> None:
        record: dict[str, Any] = {"finished": finished, "ended": ended, "tables": list(self._tables)}
        if retained := self._shelf.retained:
            places = [place for damaged_journal in retained for place in damaged_journal.damages]
            record["damaged"] = {
                "files": [journal.set_aside_name(damaged_journal.number) for damaged_journal in retained],
                **total(places),
            }
        if finished:
            summary |= {"size_bytes": {EVENTS: self._events.length, manifest.NAME: self._shelf.manifest_bytes}}
        data = to_document(summary | {"record": record})
        for name in (RUN, COPY):
            write_whole(self.path / name, data, locked=True)

    def _open_journal(self, number: int, commit: Commit) -> None:
        name = journal.name_of(number)
        check_own(self.path, name)
        write_whole(self.path / name, journal.head(self._tables, commit), locked=True)
        self._journal, self._number = AppendFile(self.path, name), number
        self._safe_bytes = self._journal.length
        self._began = commit.sample

    def _shorten_segment(self) -> None:
        """Close the first segment earlier than those of another record of the process; later ones follow it."""
        self._began -= int(self.phase * self.limits.segment_samples)

    def _sync(self) -> None:
        """Wait until all written data is safe."""
        self._settle(self._syncing.done(wait=True))
        self._syncing.begin(self._journal, self._waiting.written())
        self._settle(self._syncing.done(wait=True))
        self._synced_s = time.monotonic()

    def _settle(self, safe: tuple[int, int] | None) -> None:
        if safe is not None:
            self._safe_bytes, parts = safe
            self._waiting.safe(parts)

    def _close_open_journal(self) -> None:
        self._syncing.close()
        self._journal.close()

    def _close_segment(self, commit: Commit) -> None:
        """Continue in a new journal from this commit, and begin to convert the previous one to segments."""
        self._closed()  # if the journal is full before the previous one is converted, wait for it
        before, number = self._journal, self._number
        self._open_journal(number + 1, commit)
        before.close()
        self._shelf.seal(number)
        self._begin_closing()

    def _begin_closing(self) -> None:
        budget = self.limits.budget_bytes
        used = self._events.length + JOURNALS * self.limits.journal_bytes_max
        # Beside the journals: a segment with those that were merged into it, and new lines of the manifest.
        self._closing.begin(None if budget is None else budget - used - merged_bytes_max(budget))

    def _closed(self) -> OSError | LivebodeError | None:
        """Wait until the previous journal is converted, and report removed and damaged parts; returns an error."""
        gone, error = self._closing.result()
        for retained in self._shelf.retained[self._named :]:
            self._log.report_event(retained.event)
            self._named += 1
        if gone:
            assert self.last is not None
            names: str = gone[0].name
            if len(gone) > 1:
                names = Message("{name} and {more} more", name=names, more=len(gone) - 1)
            self._log.report(
                "record-removed",
                self.last.sample,
                self.last.time_s,
                Message(
                    "{names} removed, the oldest of the record, to meet the budget of {budget_bytes} bytes",
                    names=names,
                    budget_bytes=self.limits.budget_bytes,
                ),
                removed=[segment.name for segment in gone],
            )
        if error is not None:
            full_at = self._began + self.limits.segment_samples
            retried = Message("when the next journal is full, at sample {at_sample}", at_sample=full_at)
            self._not_closed(error, retried)
        elif self._attempts and not self._shelf.sealed and self.last is not None and not self._full(self.last.sample):
            self._report_closed()
        return error

    def _not_closed(self, error: OSError | LivebodeError, retried: str) -> None:
        """Report that a segment cannot be closed: the first, second, fourth, eighth … time."""
        self._attempts += 1
        if self._attempts & (self._attempts - 1):
            return
        assert self.last is not None
        waiting = [*self._shelf.sealed, self._number]
        self._log.report(
            "record-unclosed",
            self.last.sample,
            self.last.time_s,
            Message(
                "no segment could be closed: {why} (attempt {attempts}); it is retried {retried}, and the record "
                "remains in {in_journals}",
                why=why(error),
                attempts=self._attempts,
                retried=retried,
                in_journals=Message("1 journal")
                if len(waiting) == 1
                else Message("{journals} journals", journals=len(waiting)),
            ),
            journals=waiting,
            errno=getattr(error, "errno", None),
        )

    def _report_closed(self) -> None:
        assert self.last is not None
        message = Message("segments are closed again, after 1 failed attempt")
        if self._attempts > 1:
            message = Message("segments are closed again, after {attempts} failed attempts", attempts=self._attempts)
        self._log.report("record-closed", self.last.sample, self.last.time_s, message, attempts=self._attempts)
        self._attempts = 0

    def _failed(self, error: OSError, sample: int, time_s: float) -> None:
        with contextlib.suppress(OSError):  # data that was being synced may still be safe
            self._settle(self._syncing.done(wait=True))
        self._journal.back_to(self._safe_bytes)
        self._waiting.failed(self.limits.held_bytes)
        if self._pause is None:
            self._pause = self._log.report(
                "record-paused",
                sample,
                time_s,
                Message(
                    "{why}; recording pauses at sample {at_sample} and resumes when the disk can be written again",
                    why=why(error),
                    at_sample=sample,
                ),
                errno=error.errno,
            )

    def _go_on_after_pause(self, sample: int, time_s: float) -> None:
        if self._pause is None:
            return
        lost = self._waiting.drain_lost()
        message = Message("recording resumes at sample {at_sample}; nothing is lost", at_sample=sample)
        if lost:
            rows = (
                f"{sums['rows']} rows of {table} of samples {sums['first_sample']} to {sums['last_sample']}"
                for table, sums in lost.items()
            )
            message = Message(
                "recording resumes at sample {at_sample}; {rows} are lost",
                at_sample=sample,
                rows=", ".join(rows),
            )
        self._log.report(
            "record-resumed",
            sample,
            time_s,
            message,
            paused_at=self._pause.sample,
            lost=lost,
            lost_events=self._log.drain_given_up(),
        )
        self._pause = None
