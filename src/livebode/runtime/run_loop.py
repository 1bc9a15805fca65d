"""RunLoop: one run, from its first sample to run.json, whatever is estimated from the samples; its Stream."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from math import gcd
from typing import TYPE_CHECKING, Any, Self

from livebode.configuration import RecordSection
from livebode.core import Block, Event, LivebodeError, Responses, SignalError
from livebode.preparation import ChannelCheck, check_length
from livebode.runtime.documents import (
    Channels,
    ClockSet,
    Document,
    RunEnded,
    RunStarted,
    RunStep,
    Subscriber,
    TrackerResults,
)
from livebode.runtime.estimate import Estimate, Outcome, RunContext
from livebode.runtime.feed import Feed
from livebode.runtime.recorder import Destination, WholeRecord
from livebode.runtime.run_control import StoppedError
from livebode.runtime.run_counts import EventGroups, RunCounts
from livebode.sources.live import KINDS

if TYPE_CHECKING:
    from livebode.runtime.joining import Steps, WaitingSpectra
    from livebode.runtime.recorder import Recorder


_URGENT = {"change", "backlog", "doubtful", "roles-doubtful", "window-doubtful", "baseline-unknown", "not-monitored"}
_LOGGED_ELSEWHERE = {*KINDS, "configuration-applied", "configuration-refused"}
_logger = logging.getLogger(__name__)


class Stream:
    """The one path from a run to its record and its subscribers.

    Events go through `groups`, and are logged where their source has not done so.
    """

    def __init__(self, recorder: Recorder, subscribers: Sequence[Subscriber], groups: EventGroups) -> None:
        self._recorder, self._subscribers, self._groups = recorder, subscribers, groups

    def publish(self, document: Document) -> None:
        """Record it, then pass it to every subscriber; an event in its group, or later."""
        if isinstance(document, Event):
            self._report(self._groups.take(document))
            return
        self._recorder.take(document)
        self.announce(document)

    def publish_all(self, documents: Iterable[Document]) -> None:
        """Publish several, in this order."""
        for document in documents:
            self.publish(document)

    def announce(self, document: Document) -> None:
        """Pass it to every subscriber without recording it: it is in the record already, or is not for it."""
        for subscriber in self._subscribers:
            subscriber(document)

    def report_groups(self, time_s: float) -> None:
        """Publish the events that waited long enough at machine time `time_s`."""
        self._report(self._groups.due(time_s))

    def report_groups_while_silent(self, now_s: float) -> None:
        """The same at `now_s` of this computer, while the machine time does not advance."""
        self._report(self._groups.due_while_silent(now_s))

    def finish_groups(self) -> None:
        """Publish all waiting events, at the end of the run."""
        self._report(self._groups.finish())

    def _report(self, events: list[Event]) -> None:
        for event in events:
            self._recorder.take(event)
            if event.kind not in _LOGGED_ELSEWHERE:
                level = logging.WARNING if event.kind in _URGENT else logging.INFO
                _logger.log(level, "%s: %s", self._recorder.path, event.message)
            self.announce(event)


_SILENT_S = 0.2  # without a Block


class RunLoop:
    """One run. `run` does all of it; a run that another one continues uses `follow`, `end` and `finish` in its context.

    Parameters
    ----------
    feed
        The samples, as they reach the loop.
    estimate
        What is computed from the samples.
    to
        Directory and subscribers of the run.
    about
        Additional entries of run.json.
    segments
        Settings of a record with a journal; None for a record that is written at once.
    """

    def __init__(
        self,
        feed: Feed,
        estimate: Estimate,
        to: Destination,
        *,
        about: dict[str, Any],
        segments: RecordSection | None = None,
    ) -> None:
        self.feed, self.to, self.estimate = feed, to, estimate
        self._source, self._control = feed.source, feed.control
        self._blocks = feed.blocks(estimate.channels)
        check = ChannelCheck(tuple(estimate.signals), estimate.reference)
        self._counts = RunCounts(check, feed.started, feed.previous)
        self._done: dict[str, Any] = {}
        self._found_on_the_way: dict[str, Any] = {}
        self._step = gcd(estimate.step, estimate.window)
        self._origin_s = 0.0
        self._stepped_s = time.monotonic()
        self._events: list[Event] = []  # found in this Block, published after its responses
        self._begun = estimate.describe(about, self._source.channels)
        self._recorder = self._recorder_of(segments)
        self._stream = Stream(self._recorder, to.subscribers, self._counts.groups)
        estimate.begin(RunContext(feed, about, self._counts, self._recorder, self._events))

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
        self.feed.run(self._steps(), self._recorder)
        self._stream.announce(RunStep("ending"))
        self._control.looked_s = None
        self._recorder.commit_last()
        if not self._counts.stop:
            raise SignalError("empty", "the recording has no samples", "choose another one")

    def _steps(self) -> Steps:
        """Process every Block, one in each step; whether the next step is due, or only when samples come."""
        for block in self._numbered():
            if block is None:
                self._report_in_silence()
            else:
                for piece in self._recorder.pieces(block):
                    yield from self._process(piece)
                    yield from self._wait_for_record()
            if self._control.changing:
                break
            # Samples that complete no response wait for those that do, at most until the next tick.
            yield self.feed.is_due(self._step - self._counts.stop % self._step)

    def _wait_for_record(self) -> Steps:
        if self._recorder.is_behind:
            with self.feed.record_wait:
                while self._recorder.is_behind:
                    yield False

    def _process(self, block: Block) -> Steps:
        """One piece of samples through the house, in this order."""
        self._recorder.write_samples(block)
        self._publish_noticed(block)
        self._stream.publish_all(self.estimate.monitor(block))
        self._count(block)
        joined = yield from self._joined(block)
        self._estimate(lambda: self.estimate.process(block) if joined is None else joined)
        self._report_events()
        self._stream.announce(TrackerResults(block, self.estimate.counts["samples"], self._source.samples))
        self._publish_findings(self.estimate.check(block))  # of seconds of samples at a time; no result waits for it
        with self.feed.record_wait:
            self._recorder.commit(block)

    def _joined(self, block: Block) -> Generator[bool | WaitingSpectra, Responses | None, Any]:
        """The results of a Block that is tracked together with other axes; None where it is tracked alone."""
        spectra = self.estimate.waiting_spectra(block) if self.feed.live else None
        joined = None if spectra is None else (yield spectra)
        if joined is None or len(joined) == len(block):
            return joined
        return Responses.join([joined, self.estimate.process(block.cut(len(joined), len(block)))])

    def _estimate(self, process: Callable[[], Any]) -> None:
        """Compute results, and publish them."""
        before = time.perf_counter()
        results = process()
        tracked_s = time.perf_counter() - before
        if results is not None:
            self._counts.take(self.estimate.valid(results), tracked_s)
            self._stream.publish_all(self.estimate.documents(results))

    def _publish_noticed(self, block: Block) -> None:
        noticed = () if self._counts.stop else self.feed.noticed  # a continued record already has them
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
        for block in self._blocks:
            self._control.looked_s = time.monotonic()
            if block is not None:
                self._record_found(self.feed.add(block, self._recorder.begun, self._events.append))
            if self._control.ended and self.feed.live is None:
                raise StoppedError("ended before the end of the recording")
            yield block

    def _report_events(self) -> None:
        """Publish the events since the last call."""
        self._stepped_s = time.monotonic()
        stop, time_s = self.position
        self._stream.publish_all(self.feed.events(stop))
        if self._events:
            self._stream.publish_all(self._events)
            self._events.clear()
        self._stream.publish_all(self._control.take_recorded())
        self._stream.publish_all(self.feed.load_events(stop, time_s))
        self._stream.publish_all(self._control.take_reported(stop, time_s))
        self._stream.report_groups(time_s)
        if (section := self._control.take_record_section()) is not None:
            self._recorder.limit(section)

    def _report_in_silence(self) -> None:
        """Publish and record the events of a machine that sends nothing."""
        if self._counts.stop and (self.feed.asks_commit or time.monotonic() - self._stepped_s > _SILENT_S):
            self._report_events()
            self._stream.report_groups_while_silent(time.monotonic())
            with self.feed.record_wait:
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
        channels = {channel.name: channel for channel in self._source.channels}
        used = tuple(channels[name] for name in self.estimate.channels)
        self._stream.announce(Channels(used, self.estimate.rate_hz))
        self._record_found(self.feed.clock(self._recorder.begun))
        for document in self.estimate.resume():
            self._stream.announce(document)

    def _record_found(self, found: dict[str, Any]) -> None:
        """Publish what was found on the clock of a live run, and write it to run.json."""
        if "clock" in found:
            self._stream.announce(ClockSet(tuple(found["clock"])))
        if found:
            self._renew(**found)

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
            recorded = self._counts.responses or self.feed.previous is not None or continued_in
            if not self._recorder.continues or not recorded:
                raise
            # Recorded data remains, with an event that reports the error.
            self._stream.publish(Event("doubtful", *self.position, error.words))
        left = self.feed.last_events(*self.position)
        self._stream.publish_all(self.feed.remaining_events(self._counts.stop))
        self._stream.publish_all(self._control.take_reported(*self.position) + left)
        self._done, events = self.estimate.summary(*self.position)
        self._stream.publish_all(events)
        self._stream.finish_groups()
        self._done |= self._found_on_the_way
        self._done |= self.to.findings()
        if (date := self.feed.date(self.position[1], self._recorder.begun)) is not None:
            self._done["recorded"] = date
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
        with self.feed.record_wait:
            self._recorder.__enter__()
        self._control.stopped = self._recorder.stopped
        if self._counts.left_out_samples is not None:  # missing in run.json if the disk was full when it was found
            self._renew(left_out_samples=self._counts.left_out_samples)
        self.feed.resume(self._recorder)
        return self

    def __exit__(self, *error: Any) -> None:
        self._recorder.__exit__(*error)

    def _recorder_of(self, segments: RecordSection | None) -> Recorder:
        if self.to.record is not None:
            return self.to.record
        if segments is None:
            return WholeRecord(self.to.directory, self.estimate.tables, force=self.to.force)
        from livebode.runtime.segmented import SegmentedRecord  # needs a POSIX system

        channels = {channel.name: channel for channel in self._source.channels}
        return SegmentedRecord(
            self.to.directory,
            segments,
            force=self.to.force,
            tables=self.estimate.tables,
            summary=self._begun,
            channels=[channels[name] for name in self.estimate.channels],
            rate_hz=self.estimate.rate_hz,
            parts=dict(self.estimate.parts) | {"counts": self._counts},
            again=self.feed.again,
            ends=lambda: self._source.samples is not None and not self._control.ended,
            publish=lambda event: self._stream.announce(event),
            waiting=self._counts.groups.waiting,
            position=self.feed.position,
            source=self.feed.live,
            previous=self.feed.previous,
        )
