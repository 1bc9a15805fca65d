"""RunLoop: one run, from its first sample to run.json."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import gcd, nan
from pathlib import Path
from typing import Any, Protocol, Self

from livebode.analysis.overview import LIVE_VALUES_MAX, Overview
from livebode.configuration.record_section import RecordSection
from livebode.core import Block, Channel, Event, LivebodeError, Parameters, Responses, SignalError
from livebode.estimation import plant_kinds, response_unit
from livebode.fitting import Fit
from livebode.preparation.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.runtime import summary
from livebode.runtime.ahead import LossesAhead
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.between_event import between_events
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import PreviousRun, StreamPosition
from livebode.runtime.destination import Destination
from livebode.runtime.documents import Channels, ClockSet, FitResults, RunEnded, RunStarted, TrackerResults
from livebode.runtime.drift_event import drift_events
from livebode.runtime.live_checks import LiveChecks
from livebode.runtime.pipeline import Pipeline
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


class Source(Protocol):
    """Source of the samples of a run: a recording or a simulated machine."""

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def samples(self) -> int | None: ...

    @property
    def blocks(self) -> Callable[..., Iterator[Block]]: ...


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a run: its directory, its summary as in run.json, a thinned copy of its responses, and the newest valid
    fit."""

    directory: Path
    summary: dict[str, Any]
    responses: Responses
    fit: Fit | None = None


class RunLoop:
    """One run. `run` does all of it; a run that another one continues uses `follow`, `end` and `finish` in its context.

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
        pipeline: Pipeline,
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
        self.source, self.pipeline, self.to = source, pipeline, to
        self._control, self._position, self._previous = control or RunControl(), position, previous
        self._live = isinstance(source, LiveSource)
        self._shedding = LoadShedding(source, lambda: self._control.ended) if isinstance(source, LiveSource) else None
        self._follower, settings = pipeline.follower, pipeline.follower.settings
        self._blocks: Iterator[Block | None] = (
            source.stream(pipeline.channels, wait_s=0.0)
            if isinstance(source, LiveSource)
            else source.blocks(pipeline.channels, **delivery)
        )
        check = ChannelCheck(tuple(pipeline.signals), settings.channel(settings.method.reference) or "")
        self._counts = RunCounts(check, time.perf_counter() if started is None else started, previous)
        self._noticed, self._ahead = tuple(noticed), LossesAhead()
        self._label = _schedule_label(source, settings.schedule)
        self._about = about | {"found": about.get("found", {}) | {"schedule": self._label}}
        self._plant = response_unit(source.channels, settings), plant_kinds(source.channels, settings)
        self._begun = summary.begun(self._about, self._follower, *self._plant)
        if (detection := pipeline.detection) is not None and detection.baseline is not None:
            self._begun["monitoring"] = detection.compared_with
        self._overview = Overview(LIVE_VALUES_MAX) if self._live else Overview()
        self._done: dict[str, Any] = {}
        self._found_on_the_way: dict[str, Any] = {}
        self._newest: Fit | None = None
        self._relation, self._recorded = relation or ClockRelation(), recorded
        self._numbers = SenderNumbers()
        self._step = gcd(settings.step, settings.lines.window)
        self._origin_s = 0.0
        self._stepped_s = time.monotonic()
        self._events: list[Event] = []  # found in this Block, published after its responses
        self._recorder = self._recorder_of(segments, again)
        self._stream = Stream(self._recorder, to.subscribers, self._counts.groups)
        self._checks: LiveChecks | None = None

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
        ready = self._ready_parts(block)
        self._monitor_samples(block, ready)
        responses = self._estimate(block)
        self._record_and_publish(responses)
        self._report_events()
        self._stream.announce(TrackerResults(block, self._follower.counts["samples"], self.source.samples))
        self._check_signals(block, ready)  # it examines seconds of samples at a time, and no result waits for it
        self._recorder.commit(block)

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

    def _ready_parts(self, block: Block) -> list[Block]:
        """The samples at which the machine is ready; publishes where that begins and ends, before its alarms."""
        readiness = self.pipeline.readiness
        if readiness is None:
            return [block]
        self._stream.publish_all(readiness.take(block))
        self._follower.set_aside(readiness.spans)
        return readiness.condition.parts(block)

    def _monitor_samples(self, block: Block, ready: list[Block]) -> None:
        noticed = () if self._counts.stop else self._noticed  # a continued record already has them
        for event in noticed:
            time_s = block.origin_s + event.sample / self._follower.settings.lines.rate_hz
            self._stream.publish(replace(event, time_s=time_s))
        detection = self.pipeline.detection
        if detection is not None and (self._shedding is None or self._shedding.monitors()):
            for part in ready:
                self._stream.publish_all(detection.take_samples(part))

    def _estimate(self, block: Block) -> Responses:
        self._origin_s = block.origin_s
        self._counts.check.take(block)
        self._counts.stop = block.stop
        before = time.perf_counter()
        responses = self._marked(self._follower.process(block, self._events.append))
        self._counts.take(responses, time.perf_counter() - before)
        return responses

    def _marked(self, responses: Responses) -> Responses:
        return responses if self.pipeline.readiness is None else self.pipeline.readiness.mark(responses)

    def _record_and_publish(self, responses: Responses) -> None:
        """Responses, then of those that are assessed the fits and the alarms."""
        self._overview.add(responses)
        if len(responses):
            self._stream.publish(responses)
        if self.pipeline.readiness is not None:
            responses = responses[responses.ready]
        if self.pipeline.drift is not None:
            self.pipeline.drift.add(responses)
        if self.pipeline.recordings is not None:
            self.pipeline.recordings.add(responses)
        parameters = self._fit(responses)
        detection = self.pipeline.detection
        if detection is not None and (self._shedding is None or self._shedding.to_monitor(responses)):
            self._stream.publish_all(detection.take_responses(responses, parameters))

    def _fit(self, responses: Responses) -> Parameters | None:
        fits = self.pipeline.fits
        if fits is None:
            return None
        if self._shedding is None:
            parts, events = fits.process(responses)
        else:
            with self._shedding.fitting(responses) as chosen:
                parts, events = fits.process(chosen)
        self._stream.publish(FitResults(parts))
        self._stream.publish_all(events)
        return parts[0]

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

    def _check_signals(self, block: Block, ready: list[Block]) -> None:
        """Publish findings on the signals of a live run."""
        if self._checks is not None:
            self._publish_findings(self._checks.take_ready(block, ready))

    def _publish_findings(self, found: Iterable[Event]) -> None:
        for event in found:
            self._stream.publish(event)
            if event.kind == "transient":
                self._counts.left_out_samples = int(event.details["samples"])
                self._renew(left_out_samples=self._counts.left_out_samples)

    def _begin(self) -> None:
        """Publish the start, and what the record that it continues contains."""
        begun = self._begun | ({"record": {"finished": False}} if self._recorder.continues else {})
        if (detection := self.pipeline.detection) is not None:
            begun = begun | {"monitoring": detection.compared_with}
        self._stream.announce(RunStarted(self.to.directory, begun, self._control, self._overview))
        channels = {channel.name: channel for channel in self.source.channels}
        used = tuple(channels[name] for name in self.pipeline.channels)
        self._stream.announce(Channels(used, self._follower.settings.lines.rate_hz))
        if self._relation.clock.pieces:
            self._set_clock()
        for responses in self._recorder.previous():
            self._overview.add(responses)
            self._stream.announce(responses)
            if self.pipeline.fits is not None:
                self._stream.announce(FitResults(self.pipeline.fits.process(responses[0:0])[0]))  # sets the lines
        self._checks = self._live_checks()

    def _live_checks(self) -> LiveChecks | None:
        axis, source = self.pipeline.axis, self.source
        if not isinstance(source, LiveSource) or source.spectra is not None or axis is None:
            return None
        counts, settings = self._counts, self._follower.settings
        # After a valid response, the excitation has already begun.
        begins = not (counts.judged or counts.valid_lines or self._previous is not None)
        transient = begins and not (axis.tracking.all_periods or axis.motion)
        channels = self.pipeline.channels
        return LiveChecks(
            settings,
            channels,
            roles=not counts.judged,
            transient=transient,
            judged=counts.judge,
            phase=self._recorder.phase,
        )

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
        """Check the results, and create the summary; `handed_over`: another run continues with the follower.

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
        fits, detection = self.pipeline.fits, self.pipeline.detection
        self._done = summary.begun(self._about, self._follower, *self._plant)
        self._done |= summary.done(self._follower, self._counts)
        self._newest = None if fits is None else fits.newest()
        seen = self._overview.responses()
        self._done |= summary.of_source(self.source) | summary.fitted(fits, self._newest, seen[seen.ready])
        suppressed_s = 0.0
        if self.pipeline.readiness is not None:
            self._done["readiness"] = self.pipeline.readiness.summary(self._follower.settings.lines.rate_hz)
            suppressed_s = self._done["readiness"]["suppressed_s"]
        if detection is not None:
            self._stream.publish_all(detection.finish())
            self._done["monitoring"] = detection.summary(suppressed_s)
        if self.pipeline.drift is not None:
            found = self.pipeline.drift.result()
            self._done["drift"] = summary.of_drift(found, self._follower.settings.lines)
            self._stream.publish_all(drift_events(self._done["drift"], *self.position))
        if self.pipeline.recordings is not None:
            self._done["between"] = summary.of_recordings(self.pipeline.recordings)
            self._stream.publish_all(between_events(self._done["between"], *self.position))
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
        """Publish delayed results at the end; SignalError if the responses are invalid."""
        follower, counts = self._follower, self._counts
        if self._checks is not None:
            self._publish_findings(self._checks.finish())
        counts.check.finish()
        check_length(follower.counts["samples"], follower.settings.lines.window)
        if delayed and counts.handed_out != counts.stop:
            before = time.perf_counter()
            if (responses := follower.finish(self._events.append)) is not None:
                responses = self._marked(responses)
                counts.take(responses, time.perf_counter() - before)
                self._record_and_publish(responses)
            self._report_events()
            counts.handed_out = counts.stop
        check_excitation(follower, counts.check.variance)
        check_some_valid(counts.responses, counts.valid_lines, follower)

    def finish(self) -> Outcome:
        """Draw the pictures and move the record to its place."""
        responses = self._overview.responses()

        def draw(into: Path) -> None:
            if len(responses):
                self.to.draw(responses, into, self._label, self._newest)

        self._recorder.finish(self._done, draw)
        return Outcome(self.to.directory, self._done, responses, self._newest)

    def publish_end(self) -> None:
        """Tell the subscribers that the run ended."""
        self._stream.announce(RunEnded(self._done))

    @property
    def position(self) -> tuple[int, float]:
        """Number and time of the next sample."""
        stop = self._counts.stop
        return stop, self._origin_s + stop / self._follower.settings.lines.rate_hz

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
            return WholeRecord(self.to.directory, force=self.to.force)
        from livebode.runtime.segmented import SegmentedRecord  # needs a POSIX system

        channels = {channel.name: channel for channel in self.source.channels}
        return SegmentedRecord(
            self.to.directory,
            segments,
            force=self.to.force,
            summary=self._begun,
            channels=[channels[name] for name in self.pipeline.channels],
            rate_hz=self._follower.settings.lines.rate_hz,
            parts=dict(self.pipeline.parts) | {"counts": self._counts},
            again=again,
            ends=lambda: self.source.samples is not None and not self._control.ended,
            publish=lambda event: self._stream.announce(event),
            waiting=self._counts.groups.waiting,
            position=self._position,
            previous=self._previous,
        )


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""
