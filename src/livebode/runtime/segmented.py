"""SegmentedRecord: the record of a run with a journal, and the states that continue at its end."""

from __future__ import annotations

import contextlib
import json
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Self

from livebode.configuration import RecordSection
from livebode.core import (
    Block,
    Channel,
    Event,
    LivebodeError,
    RecordError,
    RunClock,
    Spectra,
    StateError,
    Stateful,
    whole_files,
    why,
    writing,
)
from livebode.language import Message
from livebode.records import (
    FOLDER,
    ColumnTable,
    Lock,
    RunRecord,
    SegmentLimits,
    Store,
    Thinning,
    Tiers,
    Writer,
    check_folder,
    check_removable,
    no_tiers,
    remove,
    remove_folder,
    samples_of,
    to_json,
)
from livebode.runtime.continuing import SOURCE, PreviousRun, StreamPosition
from livebode.runtime.documents import Document, FitResults
from livebode.runtime.run_control import StoppedError
from livebode.runtime.same_run import check_same_run, earlier_versions
from livebode.runtime.unwritten import Unwritten
from livebode.sources.live import LiveSource

FOUND_ON_THE_WAY = "clock", "left_out_samples", "numbering", "recorded"
_PICTURES = "pictures"
_INTERVAL_S = 0.5
_PIECE_S = 0.25
_AHEAD_S = 0.75  # tracking may be so far ahead of the record; with a piece 1 s: most data that a kill can cost


class SegmentedRecord:
    """Responses, events and, on request, samples of one run; an unfinished run in the directory is continued.

    All committed data remains after an exception. A Writer does the work, except at the beginning and the end; tracking
    waits for it only where a kill could cost more than a second.

    Parameters
    ----------
    path
        Directory of the run.
    section
        Settings of the record.
    tables
        Tables of the results.
    summary
        run.json at the beginning: configuration and findings.
    channels, rate_hz
        Channels and rate of the Blocks.
    parts
        States that continue at the end of the record, by name: restored on entering, stored with every commit.
    force
        Replace an existing run instead of continuing it.
    again
        Whether the source begins with the same samples again each time; else its numbers continue.
    ends
        Whether the source has reached its end, so that the run is finished; else a stopped run can continue.
    publish
        Called with events of the record itself, in the thread of the run.
    waiting
        Events that are not passed to `write_event` yet; they are stored with every commit.
    position
        Position of a live source, stored with every commit.
    source
        This source: what is recorded is reported to it.
    previous
        The run that this one continues with the next sample.
    """

    def __init__(
        self,
        path: Path,
        section: RecordSection,
        *,
        tables: Mapping[str, ColumnTable],
        summary: Mapping[str, Any],
        channels: Sequence[Channel],
        rate_hz: float,
        parts: Mapping[str, Stateful],
        force: bool,
        again: bool,
        ends: Callable[[], bool],
        publish: Callable[[Event], None],
        waiting: Callable[[], Sequence[Event]] = tuple,
        position: StreamPosition | None = None,
        source: LiveSource | None = None,
        previous: PreviousRun | None = None,
    ) -> None:
        self.path = path
        self._position, self._source, self._waiting = position, source, waiting
        self._tracked: tuple[int, float] | None = None
        self._new, self._waited = False, waiting()
        self._first = (0, 0.0) if previous is None else (previous.sample, previous.time_s)
        self._more: dict[str, Any] = {} if previous is None else {"continues": previous.name}
        self.begun: str | None = None
        self._summary, self._rate_hz = dict(summary), rate_hz
        self._parts = dict(parts) | ({} if position is None else {SOURCE: position})
        self._force, self._again, self._ends, self._publish = force, again, ends, publish
        self._samples = samples_of(channels) if section.samples else None
        tables = dict(tables) | ({"samples": self._samples} if self._samples else {})
        self._reported: deque[Event] = deque()
        self._store = Store(path, tables, self._limits(section), self._reported.append, _tiers(self._summary))
        self._writer, self._unwritten = Writer(), Unwritten()
        self._renewer, self._renewing = Writer(), threading.Lock()
        self._renewed, self._to_renew = 0, 0
        self._due_from = 0
        self._piece = max(1, round(_PIECE_S * rate_hz))
        self._ahead_max = round(_AHEAD_S * rate_hz)

    def __enter__(self) -> Self:
        if self._force:
            make_way(self.path)
        with contextlib.ExitStack() as undo:
            undo.enter_context(self._store)
            if self._store.last is None:
                self._store.begin(self._named(self._summary), *self._first, self._states())
                self._continued = False
            else:
                self._restore(self._store.last.states)
                self._continued = self._new = True  # the continuation is reported as an event
                self._tracked = self._store.last.sample, self._store.last.time_s
                self._due_from = self._store.last.sample if self._again else 0
            undo.callback(self._publish_reported)
            undo.callback(self._writer.wait)
            undo.callback(self._renewer.wait)
            self._undo = undo.pop_all()
        self._begin_interval()
        self._publish_reported()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self._undo.close()
        if kind in (KeyboardInterrupt, SystemExit, StoppedError) and self._store.last is not None:
            self._publish(self.stopped())

    def take(self, document: Document) -> None:
        match document:
            case Event():
                self._unwritten.events.append(document)
                self._new = True
            case FitResults(parts):
                self._unwritten.parameters.extend(part for part in parts if len(part))
            case _:
                self._unwritten.results.append(document)

    def stopped(self) -> Event:
        """Message for a run that stops here, before it is finished."""
        last = self._store.last
        assert last is not None
        message = Message(
            "stopped at sample {at_sample}; the same command continues the run in {path}",
            at_sample=last.sample,
            path=repr(str(self.path)),
        )
        return Event("record-stopped", last.sample, last.time_s, message)

    def limit(self, section: RecordSection) -> None:
        """Use other settings of the record from now; the selection of recorded samples does not change."""
        self._store.limits = self._limits(section)

    def _limits(self, section: RecordSection) -> SegmentLimits:
        return SegmentLimits(
            interval_samples=max(1, round(_INTERVAL_S * self._rate_hz)),
            segment_samples=max(1, round(section.segment_s * self._rate_hz)),
            interval_s=_INTERVAL_S,
            budget_bytes=section.budget_bytes,
        )

    def previous(self) -> RunRecord | None:
        """The record that it continues; None for a new one."""
        if self._continued or "continues" in self._more:
            return RunRecord.open(self.path, self._found_damaged, matrix=True)
        return None

    @property
    def phase(self) -> float:
        return self._store.phase

    @property
    def continues(self) -> bool:
        return True

    @property
    def clock(self) -> list[tuple[float, float]]:
        """Relation of the run's seconds to the time of day, as in `RunClock` and run.json."""
        return RunClock.of(self._more).pieces

    @property
    def numbering(self) -> list[tuple[int, int, int]]:
        """Numbers of the senders, as in `SenderNumbers` and run.json."""
        return list(self._more.get("numbering", ()))

    def renew(self, **found: Any) -> None:
        """Write findings during the run to run.json; if the disk is full, they are written at the end of the run."""
        self._more |= found
        self._to_renew += 1
        # run.json needs four syncs, for which no commit waits, except those of samples that it numbers.
        (self._writer if "numbering" in found else self._renewer).add(self._renew)

    def pieces(self, block: Block) -> Iterator[Block]:
        """The samples of a Block that are not in the record yet, in pieces whose loss by a kill is short."""
        each = block.layout.hop if isinstance(block, Spectra) else 1
        known = -(-max(0, self._due_from - block.start) // each)
        if not known and len(block) <= self._piece:
            yield block
            return
        for first in range(known, len(block), self._piece):
            yield block.cut(first, first + self._piece)

    def write_samples(self, block: Block) -> None:
        """Append the samples if they are recorded; the source continues after this Block."""
        self._writer.check()  # nothing is tracked after the disk failed
        if self._samples:
            self._unwritten.blocks.append(block)
        if self._position is not None:
            self._position.take(block)

    def commit(self, block: Block) -> None:
        """Store all results up to the end of this Block if a commit is due."""
        self._tracked, self._new = (block.stop, block.origin_s + block.stop / block.rate_hz), True
        if self._due(block.stop):
            self._commit(*self._tracked)
        self._writer.check()
        self._publish_reported()

    @property
    def is_behind(self) -> bool:
        """Whether a kill now could cost more than a second after the next piece."""
        ahead = 0 if self._tracked is None else self._tracked[0] - self._reached
        return ahead >= self._ahead_max and not self._writer.idle

    def catch_up(self) -> None:
        """Wait until it is not behind."""
        if self.is_behind:
            self._writer.wait()

    def commit_last(self) -> None:
        """Store the last results; RecordError if they cannot be written."""
        if self._tracked is not None:
            self._commit(*self._tracked)
        self._wait()

    def commit_while_silent(self) -> None:
        """Record the results of the last Block, and later events, while waiting for the next one.

        The last Block may be from before the run was continued.
        """
        self._publish_reported()
        # While the disk is slow, the events of a silent machine wait for one commit together.
        if self._tracked is None or not self._due(self._tracked[0]) or not self._writer.idle:
            return
        if self._new or self._waiting() != self._waited:
            self._commit(*self._tracked)

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        """Draw the pictures, close open files and write run.json."""
        check_folder(self.path, f".{_PICTURES}.partial/bode.svg")
        with writing(self.path, RecordError, unchanged=False):
            remove_folder(self.path, f".{_PICTURES}.partial")  # the remainder of a kill
            with whole_files(self.path, _PICTURES, locked=True) as folder:
                draw(folder)
        self._wait()
        last = self._store.last
        assert last is not None
        # Results that were delayed until the end were written after the last commit, and belong to the present states.
        self._unwritten.write(self._store, self._samples)
        states = self._states()
        self._store.commit(last.sample, last.time_s, states)
        self._store.finish(self._named(summary), states, finished=self._ends() or "continued_in" in summary)

    def _begin_interval(self) -> None:
        """The next commits are due in the phase of this record."""
        assert self._store.last is not None
        limits, ahead = self._store.limits, self._store.phase
        self._reached = self._store.last.sample
        self._committed = self._reached - int(ahead * limits.interval_samples)
        self._committed_s = time.monotonic() - ahead * limits.interval_s

    def _due(self, sample: int) -> bool:
        """Whether a commit is due when the next sample has this number."""
        if self._source is not None and self._source.asks_commit:
            return True
        limits = self._store.limits
        long = time.monotonic() - self._committed_s >= limits.interval_s
        return long or sample - self._committed >= limits.interval_samples

    def _commit(self, sample: int, time_s: float) -> None:
        self._committed, self._committed_s = sample, time.monotonic()
        self._new, self._waited = False, self._waiting()
        if self._source is not None:
            self._source.asks_commit = False
        written, self._unwritten = self._unwritten, Unwritten()
        job = partial(self._write, written, sample, time_s, self._states(), self._waited)
        # A recording is read while its record is written; a machine is waited for.
        self._writer.add(job, at_once=self._position is not None and not self._store.closes_at(sample))

    def _write(
        self, written: Unwritten, sample: int, time_s: float, states: Mapping[str, bytes], waiting: Sequence[Event]
    ) -> None:
        written.write(self._store, self._samples)
        if self._store.commit(sample, time_s, states, waiting) and self._source is not None:
            self._source.record(sample)
        self._reached = sample  # also if the record is paused: the store holds it, within its limit

    def _renew(self) -> None:
        with self._renewing, contextlib.suppress(LivebodeError):
            if self._renewed < self._to_renew:
                self._renewed = self._to_renew
                self._store.renew(self._named(self._summary))

    def _wait(self) -> None:
        self._renewer.wait()
        self._writer.wait()
        self._writer.check()
        self._publish_reported()

    def _publish_reported(self) -> None:
        while self._reported:
            self._publish(self._reported.popleft())

    def _found_damaged(self, damage: Event) -> None:
        if not str(damage.details["file"]).startswith(f"{FOLDER}/"):  # the store reports damaged journals
            self._publish(damage)

    def _states(self) -> dict[str, bytes]:
        return {name: part.snapshot() for name, part in self._parts.items()}

    def _restore(self, states: Mapping[str, bytes]) -> None:
        before = RunRecord.open(self.path, self._found_damaged, matrix=True).summary
        now = json.loads(to_json(self._summary))
        check_same_run(self.path, before, now, states, self._parts)
        for name, part in self._parts.items():
            try:
                part.restore(states[name])
            except StateError as error:
                raise error.at(f"the unfinished run in {str(self.path)!r}") from None
        self._more = {name: before[name] for name in ("continues", *FOUND_ON_THE_WAY) if name in before}
        self._more |= earlier_versions(before, now)
        self.begun = (before.get("recorded") or {}).get("from")
        self._store.renew(self._named(self._summary))

    def _named(self, summary: dict[str, Any]) -> dict[str, Any]:
        return self._more | summary


def _tiers(summary: Mapping[str, Any]) -> Tiers:
    """Means of old responses; none of averages, which contain each other."""
    averages = (summary.get("configuration", {}).get("tracking") or {}).get("average")
    found = summary.get("found") or {}
    return no_tiers if averages or "bins" not in found else Thinning(found).tables


def make_way(path: Path) -> None:
    """Remove an existing run; RecordError if the directory contains something else."""
    if not os.path.lexists(path):
        return
    check_removable(path)
    lock = Lock(path)
    try:
        remove(path)
    except OSError as error:
        raise RecordError(
            "not-removable",
            f"the run in {str(path)!r} cannot be removed: {why(error)}",
            "check its permissions",
            path=str(path),
        ) from None
    finally:
        lock.release()
