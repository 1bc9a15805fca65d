"""RunLoop: one run, from its first sample to run.json, whatever is estimated from the samples."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from math import gcd, nan
from typing import Any, Self

from livebode.configuration import RecordSection
from livebode.core import Block, Event, LivebodeError, SignalError
from livebode.preparation import ChannelCheck, check_length
from livebode.runtime.ahead import LossesAhead
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import PreviousRun, StreamPosition
from livebode.runtime.destination import Destination
from livebode.runtime.documents import Channels, ClockSet, RunEnded, RunStarted, TrackerResults
from livebode.runtime.estimate import Estimate, Outcome, RunContext, Source
from livebode.runtime.provenance import recorded_live
from livebode.runtime.recorder import Recorder
from livebode.runtime.run_control import RunControl, StoppedError
from livebode.runtime.run_counts import RunCounts
from livebode.runtime.sender_numbers import SenderNumbers
from livebode.runtime.shedding import LoadShedding
from livebode.runtime.stream import Stream
from livebode.runtime.turns import Turn
from livebode.runtime.whole_record import WholeRecord
from livebode.sources.live import LiveBlock, LiveSource

_SILENT_S = 0.2  # without a Block


class RunLoop:
    """One run. `run` does all of it; a run that another one continues uses `follow`, `end` and `finish` in its context.

    Parameters
    ----------
    source
        Source of the samples.
    estimate
        What is computed from the samples.
    to
        Directory and subscribers of the run.
    about
        Additional entries of run.json.
    segments
        Settings of a record in segments; None for a record in one piece.
    again
        Whether the source begins with the same samples each time; else its numbers continue.
    started
        `time.perf_counter()` when opening the source began, to include it in the speed.
    control
        Requests from other threads.
    position
        Where a live source continues.
    previous
        The run that this one continues.
    noticed
        Events on the whole recording, found before tracking.
    relation
        The clock of a live source while it is open.
    recorded
        Gives the date of a recording, as in run.json, from the time after its last sample.
    delivery
        Arguments for the source's `blocks`.
    """

    def __init__(
        self,
        source: Source,
        estimate: Estimate,
        to: Destination,
        *,
        about: dict[str, Any],
        segments: RecordSection | None = None,
        again: bool = True,
        started: float | None = None,
        control: RunControl | None = None,
        position: StreamPosition | None = None,
        previous: PreviousRun | None = None,
        noticed: Sequence[Event] = (),
        relation: ClockRelation | None = None,
        recorded: Callable[[float], dict[str, Any]] | None = None,
        **delivery: Any,
    ) -> None:
        keep_freed_memory()
        self.source, self.to, self.estimate = source, to, estimate
        self._control, self._position, self._previous = control or RunControl(), position, previous
        self._live = isinstance(source, LiveSource)
        self._record_wait: AbstractContextManager[object] = (
            source.backlog_cause if isinstance(source, LiveSource) else nullcontext()
        )
        self._shedding = LoadShedding(source, lambda: self._control.ended) if isinstance(source, LiveSource) else None
        self._blocks: Iterator[Block | None] = (
            source.stream(estimate.channels, wait_s=0.0)
            if isinstance(source, LiveSource)
            else source.blocks(estimate.channels, **delivery)
        )
        check = ChannelCheck(tuple(estimate.signals), estimate.reference)
        self._counts = RunCounts(check, time.perf_counter() if started is None else started, previous)
        self._noticed, self._ahead = tuple(noticed), LossesAhead()
        self._done: dict[str, Any] = {}
        self._found_on_the_way: dict[str, Any] = {}
        self._relation, self._recorded = relation or ClockRelation(), recorded
        self._numbers = SenderNumbers()
        self._step = gcd(estimate.step, estimate.window)
        self._origin_s = 0.0
        self._stepped_s = time.monotonic()
        self._events: list[Event] = []  # found in this Block, published after its responses
        self._begun = estimate.describe(about, source.channels)
        self._recorder = self._recorder_of(segments, again)
        self._stream = Stream(self._recorder, to.subscribers, self._counts.groups)
        estimate.begin(
            RunContext(source, about, self._counts, self._recorder, self._shedding, self._events, previous is None)
        )

    def run(self) -> Outcome:
        """The run from its beginning to its end."""
        with self:
            self.follow()
            self.end()
            outcome = self.finish()
        self.publish_end()
        return outcome

    def follow(self) -> None:
        """Process every Block until the source ends or another configuration follows; SignalError if there is none."""
        self._begin()
        steps = self._steps()
        if isinstance(self.source, LiveSource):
            turn = Turn(steps)
            self.source.listen(turn.ask)
            turn.run()
        else:
            for _ in steps:
                self._recorder.catch_up()
        self._control.looked_s = None
        self._recorder.commit_last()
        if not self._counts.stop:
            raise SignalError("empty", "the recording has no samples", "choose another one")

    def _steps(self) -> Iterator[bool]:
        """Process every Block, one in each step; whether the next step is due, or only when samples come."""
        for block in self._numbered():
            if block is None:
                self._report_in_silence()
            else:
                for piece in self._recorder.pieces(block):
                    self._process(piece)
                    yield from self._wait_for_record()
            if self._control.changing:
                break
            yield self._is_due()

    def _wait_for_record(self) -> Iterator[bool]:
        if self._recorder.is_behind:
            with self._record_wait:
                while self._recorder.is_behind:
                    yield False

    def _is_due(self) -> bool:
        """Whether samples wait that complete a response; others wait for those, at most until the next tick."""
        if not isinstance(self.source, LiveSource):
            return False
        self.source.expect(self._step - self._counts.stop % self._step)
        return self.source.has_more

    def _process(self, block: Block) -> None:
        """One piece of samples through the house, in this order."""
        self._recorder.write_samples(block)
        self._publish_noticed(block)
        self._stream.publish_all(self.estimate.monitor(block))
        self._count(block)
        self._estimate(lambda: self.estimate.process(block))
        self._report_events()
        self._stream.announce(TrackerResults(block, self.estimate.counts["samples"], self.source.samples))
        self._publish_findings(self.estimate.check(block))  # of seconds of samples at a time; no result waits for it
        with self._record_wait:
            self._recorder.commit(block)

    def _estimate(self, process: Callable[[], Any]) -> None:
        """Compute results, and publish them."""
        before = time.perf_counter()
        results = process()
        tracked_s = time.perf_counter() - before
        if results is not None:
            self._counts.take(self.estimate.valid(results), tracked_s)
            self._stream.publish_all(self.estimate.documents(results))

    def _publish_noticed(self, block: Block) -> None:
        noticed = () if self._counts.stop else self._noticed  # a continued record already has them
        for event in noticed:
            time_s = block.origin_s + event.sample / self.estimate.rate_hz
            self._stream.publish(replace(event, time_s=time_s))

    def _count(self, block: Block) -> None:
        """Count a piece of samples, before it is tracked."""
        self._origin_s = block.origin_s
        self._counts.check.take(block)
        self._counts.stop = block.stop

    def _numbered(self) -> Iterator[Block | None]:
        """Blocks with the run's numbers and clock; None while a live source is silent."""
        # The arrival of samples from a file or a pipe does not show when they were taken.
        source = self.source
        paced = isinstance(source, LiveSource) and source.paced and not source.on_demand
        for block in self._blocks:
            self._control.looked_s = time.monotonic()
            if isinstance(block, LiveBlock) and self._numbers.take(block):
                self._renew(numbering=self._numbers.pieces)
            if paced and isinstance(block, LiveBlock) and self._relation.take(block, self._events.append):
                self._set_clock()
            if self._control.ended and not self._live:
                raise StoppedError("ended before the end of the recording")
            yield block

    def _report_events(self) -> None:
        """Publish the events since the last call."""
        self._stepped_s = time.monotonic()
        self._stream.publish_all(self._source_events())
        self._stream.publish_all(self._events)
        self._events.clear()
        self._stream.publish_all(self._control.take_recorded())
        if self._shedding is not None:
            self._stream.publish_all(self._shedding.take_events(*self.position))
        self._stream.publish_all(self._control.take_reported(*self.position))
        self._stream.report_groups(self.position[1])
        if (section := self._control.take_record_section()) is not None:
            self._recorder.limit(section)

    def _report_in_silence(self) -> None:
        """Publish and record the events of a machine that sends nothing."""
        asked = isinstance(self.source, LiveSource) and self.source.asks_commit
        if self._counts.stop and (asked or time.monotonic() - self._stepped_s > _SILENT_S):
            self._report_events()
            self._stream.report_groups_while_silent(time.monotonic())
            with self._record_wait:
                self._recorder.commit_while_silent()

    def _publish_findings(self, found: Iterable[Event]) -> None:
        for event in found:
            self._stream.publish(event)
            if event.kind == "transient":
                self._counts.left_out_samples = int(event.details["samples"])
                self._renew(left_out_samples=self._counts.left_out_samples)

    def _begin(self) -> None:
        """Publish the start, and what the record that it continues contains."""
        begun = self._begun | ({"record": {"finished": False}} if self._recorder.continues else {})
        begun |= self.estimate.compared_with
        self._stream.announce(RunStarted(self.to.directory, begun, self._control, self.estimate.overview))
        channels = {channel.name: channel for channel in self.source.channels}
        used = tuple(channels[name] for name in self.estimate.channels)
        self._stream.announce(Channels(used, self.estimate.rate_hz))
        if self._relation.clock.pieces:
            self._set_clock()
        for document in self.estimate.resume():
            self._stream.announce(document)

    def _source_events(self) -> list[Event]:
        """Events of a live source; a recording has all of them at the start."""
        if not isinstance(self.source, LiveSource):
            return []
        return self._ahead.released(self.source.take_events(), self._counts.stop)

    def _set_clock(self) -> None:
        """Publish the clock of a live run."""
        pieces = self._relation.clock.pieces
        self._stream.announce(ClockSet(tuple(pieces)))
        self._renew(clock=list(pieces), recorded=self._date(None))

    def _date(self, to_s: float | None) -> dict[str, Any]:
        """Date of a live run, up to the time after its last sample; None while it runs."""
        clock, previous = self._relation.clock, self._previous
        from_s = previous.time_s if previous is not None else clock.pieces[0][0] if clock.pieces else nan
        date = recorded_live(clock, from_s, to_s)
        return date | ({"from": self._recorder.begun} if self._recorder.begun else {})

    def _renew(self, **found: Any) -> None:
        """Write findings during the run to run.json, now and at the end."""
        self._found_on_the_way |= found
        with suppress(LivebodeError):  # if the disk is full, it is written at the end of the run
            self._recorder.renew(**found)

    def end(self, continued_in: str | None = None, *, handed_over: bool = False) -> None:
        """Check the results, and create the summary; `handed_over`: another run continues with the tracker's state.

        Raises
        ------
        SignalError
            If the signals are invalid. In segments they remain recorded if there are responses, and an event reports
            it.
        """
        try:
            self._judge(delayed=not handed_over)
        except LivebodeError as error:
            recorded = self._counts.responses or self._previous is not None or continued_in
            if not self._recorder.continues or not recorded:
                raise
            # Recorded data remains, with an event that reports the error.
            self._stream.publish(Event("doubtful", *self.position, error.words))
        left = [] if self._shedding is None else self._shedding.finish(*self.position)
        self._stream.publish_all(self._source_events() + self._ahead.finish())
        self._stream.publish_all(self._control.take_reported(*self.position) + left)
        self._done, events = self.estimate.summary(*self.position)
        self._stream.publish_all(events)
        self._stream.finish_groups()
        self._done |= self._found_on_the_way
        self._done |= self.to.findings()
        if self._live:
            self._done["recorded"] = self._date(self.position[1])
        elif self._recorded is not None:
            self._done["recorded"] = self._recorded(self.position[1])
        if continued_in is not None:
            self._done["continued_in"] = continued_in

    def _judge(self, *, delayed: bool) -> None:
        """Publish delayed results at the end; SignalError if the results are invalid."""
        counts = self._counts
        self._publish_findings(self.estimate.last_findings())
        counts.check.finish()
        check_length(self.estimate.counts["samples"], self.estimate.window)
        if delayed and counts.handed_out != counts.stop:
            self._estimate(self.estimate.finish)
            self._report_events()
            counts.handed_out = counts.stop
        self._stream.publish_all(self.estimate.judge())

    def finish(self) -> Outcome:
        """Draw the pictures and move the record to its place."""
        self._recorder.finish(self._done, lambda into: self.to.draw(self.estimate, into))
        return self.estimate.outcome(self.to.directory, self._done)

    def publish_end(self) -> None:
        """Tell the subscribers that the run ended."""
        self._stream.announce(RunEnded(self._done))

    @property
    def position(self) -> tuple[int, float]:
        """Number and time of the next sample."""
        stop = self._counts.stop
        return stop, self._origin_s + stop / self.estimate.rate_hz

    def __enter__(self) -> Self:
        with self._record_wait:
            self._recorder.__enter__()
        self._control.stopped = self._recorder.stopped
        if self._counts.left_out_samples is not None:  # missing in run.json if the disk was full when it was found
            self._renew(left_out_samples=self._counts.left_out_samples)
        if self._recorder.clock:
            self._relation.clock.pieces = list(self._recorder.clock)
        self._numbers = SenderNumbers.of(self._recorder.numbering)
        return self

    def __exit__(self, *error: Any) -> None:
        self._recorder.__exit__(*error)

    def _recorder_of(self, segments: RecordSection | None, again: bool) -> Recorder:
        if self.to.record is not None:
            return self.to.record
        if segments is None:
            return WholeRecord(self.to.directory, self.estimate.tables, force=self.to.force)
        from livebode.runtime.segmented import SegmentedRecord  # needs a POSIX system

        channels = {channel.name: channel for channel in self.source.channels}
        source = self.source if isinstance(self.source, LiveSource) else None
        if source is not None:
            source.has_record = True
        return SegmentedRecord(
            self.to.directory,
            segments,
            force=self.to.force,
            tables=self.estimate.tables,
            summary=self._begun,
            channels=[channels[name] for name in self.estimate.channels],
            rate_hz=self.estimate.rate_hz,
            parts=dict(self.estimate.parts) | {"counts": self._counts},
            again=again,
            ends=lambda: self.source.samples is not None and not self._control.ended,
            publish=lambda event: self._stream.announce(event),
            waiting=self._counts.groups.waiting,
            position=self._position,
            source=source,
            previous=self._previous,
        )
