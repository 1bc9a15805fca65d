"""SampleLoop: one run, from its first sample to run.json, whatever is computed from the samples."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from math import gcd, nan
from pathlib import Path
from typing import Any, Generic, Protocol, Self, TypeVar

from livebode.configuration.record_section import RecordSection
from livebode.core import Block, Channel, Event, LivebodeError, SignalError
from livebode.preparation.checks import ChannelCheck
from livebode.runtime.ahead import LossesAhead
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import PreviousRun, StreamPosition
from livebode.runtime.destination import Destination
from livebode.runtime.documents import Channels, ClockSet, RunEnded, TrackerResults
from livebode.runtime.provenance import recorded_live
from livebode.runtime.recorder import Recorder
from livebode.runtime.run_control import RunControl, StoppedError
from livebode.runtime.run_counts import RunCounts
from livebode.runtime.sample_pipeline import SamplePipeline
from livebode.runtime.sender_numbers import SenderNumbers
from livebode.runtime.shedding import LoadShedding
from livebode.runtime.stream import Stream
from livebode.runtime.turns import Turn
from livebode.runtime.whole_record import WholeRecord
from livebode.sources.live import LiveBlock, LiveSource

_SILENT_S = 0.2  # without a Block
Result = TypeVar("Result")


class Source(Protocol):
    """Source of the samples of a run: a recording or a simulated machine."""

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def samples(self) -> int | None: ...

    @property
    def blocks(self) -> Callable[..., Iterator[Block]]: ...


class SampleLoop(ABC, Generic[Result]):
    """One run. `run` does all of it; a run that another one continues uses `follow`, `end` and `finish` in its context.

    A subclass computes: it processes a Block, judges the results at the end, and describes them for run.json.

    Parameters
    ----------
    source
        Source of the samples.
    pipeline
        Processes the samples.
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
        pipeline: SamplePipeline,
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
        self.source, self.to, self._samples = source, to, pipeline
        self._control, self._position, self._previous = control or RunControl(), position, previous
        self._live = isinstance(source, LiveSource)
        self._shedding = LoadShedding(source, lambda: self._control.ended) if isinstance(source, LiveSource) else None
        self._blocks: Iterator[Block | None] = (
            source.stream(pipeline.channels, wait_s=0.0)
            if isinstance(source, LiveSource)
            else source.blocks(pipeline.channels, **delivery)
        )
        check = ChannelCheck(tuple(pipeline.signals), pipeline.reference)
        self._counts = RunCounts(check, time.perf_counter() if started is None else started, previous)
        self._noticed, self._ahead = tuple(noticed), LossesAhead()
        self._about = about
        self._done: dict[str, Any] = {}
        self._found_on_the_way: dict[str, Any] = {}
        self._relation, self._recorded = relation or ClockRelation(), recorded
        self._numbers = SenderNumbers()
        self._step = gcd(pipeline.step, pipeline.lines.window)
        self._origin_s = 0.0
        self._stepped_s = time.monotonic()
        self._events: list[Event] = []  # found in this Block, published after its responses
        self._begun = self._describe()
        self._recorder = self._recorder_of(segments, again)
        self._stream = Stream(self._recorder, to.subscribers, self._counts.groups)

    @abstractmethod
    def _describe(self) -> dict[str, Any]:
        """run.json at the beginning."""

    @abstractmethod
    def _announce_start(self, begun: dict[str, Any]) -> None:
        """Pass the start, with run.json at the beginning, to the subscribers."""

    @abstractmethod
    def _announce_previous(self) -> None:
        """Pass the newest results of the record that this run continues to the subscribers."""

    @abstractmethod
    def _compute(self, block: Block) -> list[Block]:
        """Compute and publish all results of a piece of samples; its parts in which the machine is ready."""

    @abstractmethod
    def _check_signals(self, block: Block, ready: list[Block]) -> None:
        """Publish findings on the signals of a live run."""

    @abstractmethod
    def _judge(self, *, delayed: bool) -> None:
        """Publish delayed results at the end; SignalError if the results are invalid."""

    @abstractmethod
    def _results(self) -> dict[str, Any]:
        """run.json at the end; events about the whole run are published."""

    @abstractmethod
    def _draw(self, into: Path) -> None:
        """Draw the pictures of the run into this folder."""

    @abstractmethod
    def _outcome(self) -> Result:
        """The result of the run."""

    def run(self) -> Result:
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
                    while self._recorder.is_behind:
                        yield False
            if self._control.changing:
                break
            yield self._is_due()

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
        ready = self._compute(block)
        self._report_events()
        self._stream.announce(TrackerResults(block, self._samples.counts["samples"], self.source.samples))
        self._check_signals(block, ready)  # it examines seconds of samples at a time, and no result waits for it
        self._recorder.commit(block)

    def _publish_noticed(self, block: Block) -> None:
        noticed = () if self._counts.stop else self._noticed  # a continued record already has them
        for event in noticed:
            time_s = block.origin_s + event.sample / self._samples.lines.rate_hz
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
        paced = isinstance(source, LiveSource) and source.paced and not source.waits
        for block in self._blocks:
            self._control.looked_s = time.monotonic()
            if paced and isinstance(block, LiveBlock) and self._relation.take(block, self._events.append):
                self._set_clock()
            if isinstance(block, LiveBlock) and self._numbers.take(block):
                self._renew(numbering=self._numbers.pieces)
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
        if self._counts.stop and time.monotonic() - self._stepped_s > _SILENT_S:
            self._report_events()
            self._stream.report_groups_while_silent(time.monotonic())
            self._recorder.commit_while_silent()

    def _publish_findings(self, found: Iterable[Event]) -> None:
        for event in found:
            self._stream.publish(event)
            if event.kind == "transient":
                self._counts.left_out_samples = int(event.details["samples"])
                self._renew(left_out_samples=self._counts.left_out_samples)

    def _begin(self) -> None:
        """Publish the start, and what the record that it continues contains."""
        self._announce_start(self._begun | ({"record": {"finished": False}} if self._recorder.continues else {}))
        channels = {channel.name: channel for channel in self.source.channels}
        used = tuple(channels[name] for name in self._samples.channels)
        self._stream.announce(Channels(used, self._samples.lines.rate_hz))
        if self._relation.clock.pieces:
            self._set_clock()
        self._announce_previous()

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
            self._stream.publish(Event("doubtful", *self.position, str(error)))
        left = [] if self._shedding is None else self._shedding.finish(*self.position)
        self._stream.publish_all(self._source_events() + self._ahead.finish())
        self._stream.publish_all(self._control.take_reported(*self.position) + left)
        self._done = self._results()
        self._stream.finish_groups()
        self._done |= self._found_on_the_way
        self._done |= self.to.findings()
        if self._live:
            self._done["recorded"] = self._date(self.position[1])
        elif self._recorded is not None:
            self._done["recorded"] = self._recorded(self.position[1])
        if continued_in is not None:
            self._done["continued_in"] = continued_in

    def finish(self) -> Result:
        """Draw the pictures and move the record to its place."""
        self._recorder.finish(self._done, self._draw)
        return self._outcome()

    def publish_end(self) -> None:
        """Tell the subscribers that the run ended."""
        self._stream.announce(RunEnded(self._done))

    @property
    def position(self) -> tuple[int, float]:
        """Number and time of the next sample."""
        stop = self._counts.stop
        return stop, self._origin_s + stop / self._samples.lines.rate_hz

    def __enter__(self) -> Self:
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
            return WholeRecord(self.to.directory, force=self.to.force, matrix=bool(self._begun.get("matrix")))
        from livebode.runtime.segmented import SegmentedRecord  # needs a POSIX system

        channels = {channel.name: channel for channel in self.source.channels}
        return SegmentedRecord(
            self.to.directory,
            segments,
            force=self.to.force,
            summary=self._begun,
            channels=[channels[name] for name in self._samples.channels],
            rate_hz=self._samples.lines.rate_hz,
            parts=dict(self._samples.parts) | {"counts": self._counts},
            again=again,
            ends=lambda: self.source.samples is not None and not self._control.ended,
            publish=lambda event: self._stream.announce(event),
            waiting=self._counts.groups.waiting,
            position=self._position,
            previous=self._previous,
        )
