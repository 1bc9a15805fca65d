"""Following: processes the samples of a source in a pipeline, writes the run directory, and returns the results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from livebode.analysis.overview import Overview
from livebode.configuration.axis import RecordSection
from livebode.core import Block, Channel, Event, LivebodeError, Parameters, Responses, SignalError
from livebode.estimation import response_unit
from livebode.fitting import Fit
from livebode.preparation.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.records import RunDirectory
from livebode.runtime import summary
from livebode.runtime.ahead import LossesAhead
from livebode.runtime.announcing import Announcing
from livebode.runtime.audience import Audience, Outlet
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import Before, StreamPosition
from livebode.runtime.destination import Destination
from livebode.runtime.fits import Fits
from livebode.runtime.live_checks import LiveChecks
from livebode.runtime.orders import Orders, StoppedError
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.shedding import LoadShedding
from livebode.runtime.tally import Tally
from livebode.sources.live import Health, LiveBlock, LiveSource

if TYPE_CHECKING:
    from livebode.runtime.segmented import SegmentedRun


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


class Tracking:
    """One run, from its first Block to run.json. Use it as a context manager around `follow`, `end` and `finish`.

    Parameters
    ----------
    source
        Source of the samples.
    pipeline
        Processes the samples.
    to
        Directory and receivers of the run.
    about
        Additional entries of run.json.
    kept
        Settings of a record in segments; None for a run in one piece.
    again
        Whether the source begins with the same samples each time; else its numbers continue.
    started
        `time.perf_counter()` when opening the source began, to include it in the speed.
    orders
        Requests from outside.
    position
        Where a live source continues.
    before
        The run that this one continues.
    noticed
        Events on the whole recording, found before tracking.
    relation
        The clock of a live source while it is open.
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
        kept: RecordSection | None,
        again: bool = True,
        started: float | None = None,
        orders: Orders | None = None,
        position: StreamPosition | None = None,
        before: Before | None = None,
        noticed: Sequence[Event] = (),
        relation: ClockRelation | None = None,
        **delivery: Any,
    ) -> None:
        _keep_freed_memory()
        self.source, self.pipeline, self.to, self._kept = source, pipeline, to, kept
        self._orders, self._position = orders or Orders(), position
        self._shedding: LoadShedding | None = None
        if isinstance(source, LiveSource):
            self._shedding = LoadShedding(source, lambda: self._orders.ended)
        self._follower, settings = pipeline.follower, pipeline.follower.settings
        if isinstance(source, LiveSource):
            delivery["until"] = partial(self._until, delivery.get("until", lambda: False))
        self._blocks = source.blocks(pipeline.channels, **delivery)
        check = ChannelCheck(tuple(pipeline.signals), settings.channel(settings.method.reference) or "")
        self._tally = Tally(check, time.perf_counter() if started is None else started, before)
        self._goes_on = before is not None
        self._noticed = tuple(noticed)
        self._announcing, self._ahead = Announcing(), LossesAhead()
        self._label = _schedule_label(source, settings.schedule)
        about = about | {"found": about.get("found", {}) | {"schedule": self._label}}
        self._about = about
        self._begun = summary.begun(about, self._follower, response_unit(source.channels, settings))
        self._overview = Overview()
        self._done: dict[str, Any] = {}
        self._found_on_the_way: dict[str, Any] = {}
        self._newest: Fit | None = None
        self._relation = relation or ClockRelation()
        self._origin_s = 0.0
        self._stepped_s = time.monotonic()
        self.recorder = self._recorder(again, before)
        self._out = Outlet(self.recorder, to.audience, self._tally.groups)

    def _recorder(self, again: bool, before: Before | None) -> RunDirectory | SegmentedRun:
        if self._kept is None:
            return RunDirectory(self.to.directory, force=self.to.force)
        from livebode.runtime.segmented import SegmentedRun  # needs a POSIX system

        channels = {channel.name: channel for channel in self.source.channels}
        return SegmentedRun(
            self.to.directory,
            self._kept,
            force=self.to.force,
            summary=self._begun,
            channels=[channels[name] for name in self.pipeline.channels],
            rate_hz=self._follower.settings.lines.rate_hz,
            parts=dict(self.pipeline.parts) | {"tally": self._tally},
            again=again,
            ends=self.source.samples is not None,
            tell=self._said,
            waiting=self._tally.groups.waiting,
            position=self._position,
            before=before,
        )

    def _said(self, event: Event) -> None:
        self.to.tell(event)
        self.to.audience.write_event(event)

    def __enter__(self) -> Self:
        recorder = self.recorder.__enter__()
        if not isinstance(recorder, RunDirectory):
            self._orders.left = recorder.stopped
            if self._tally.left_out_samples is not None:  # missing in run.json if the disk was full when it was found
                self._renew(left_out_samples=self._tally.left_out_samples)
            if recorder.clock:
                self._relation.clock.pieces = recorder.clock
        return self

    def __exit__(self, *error: Any) -> None:
        self.recorder.__exit__(*error)

    @property
    def summary(self) -> dict[str, Any]:
        """The final run.json; empty before `end`."""
        return self._done

    @property
    def position(self) -> tuple[int, float]:
        """Number and time of the next sample."""
        stop = self._tally.stop
        return stop, self._origin_s + stop / self._follower.settings.lines.rate_hz

    def follow(self) -> None:
        """Process and record every Block; SignalError if there is none."""
        fits = self.pipeline.fits
        begun = self._begun | ({} if self._kept is None else {"record": {"finished": False}})
        self.to.audience.share(self._overview)
        self.to.audience.begin(self.to.directory, begun, _health(self.source))
        if self._relation.clock.pieces:
            self._set_clock()
        blocks = self._clocked()
        if not isinstance(self.recorder, RunDirectory):
            for responses in self.recorder.before():
                self._overview.add(responses)
                self.to.audience.write(responses)
                if fits is not None:
                    fits.take(responses[0:0], self._out)  # sets the lines
            blocks = self.recorder.feed(blocks)
        blocks = self._watched(blocks)
        noticed = () if self._tally.stop else self._noticed  # a continued record already has them
        for block in _told(blocks, self.to.audience):
            for event in noticed:
                time_s = block.origin_s + event.sample / self._follower.settings.lines.rate_hz
                self._out.write_event(replace(event, time_s=time_s))
            noticed = ()
            if self._orders.ended and not isinstance(self.source, LiveSource):
                raise StoppedError("ended before the end of the recording")
            self._origin_s = block.origin_s
            self._tally.check.take(block)
            self._tally.stop = block.stop
            self._step(partial(self._follower.process, block))
            self.to.progress(self._follower.counts["samples"], self.source.samples)
        if not self._tally.stop:
            raise SignalError("empty", "the recording has no samples", "choose another one")

    def _watched(self, blocks: Iterator[Block]) -> Iterator[Block]:
        """The same Blocks; each is checked and monitored."""
        if (checks := self._live_checks()) is not None:
            blocks = checks.over(blocks, self._found)
        if (watching := self.pipeline.watching) is not None:
            has_time = (lambda: True) if self._shedding is None else self._shedding.monitors
            blocks = watching.over(blocks, self._out.write_event, has_time)
        return blocks

    def _live_checks(self) -> LiveChecks | None:
        axis, source = self.pipeline.axis, self.source
        if not isinstance(source, LiveSource) or source.spectra is not None or axis is None:
            return None
        tally, settings = self._tally, self._follower.settings
        # After a valid response, the excitation has already begun.
        begins = not (tally.judged or tally.valid_lines or self._goes_on)
        transient = begins and not (axis.tracking.all_periods or axis.motion)
        channels = self.pipeline.channels
        return LiveChecks(settings, channels, roles=not tally.judged, transient=transient, judged=tally.judge)

    def _found(self, event: Event) -> None:
        """Record and publish the findings on the signals of a live run."""
        self.to.tell(event)
        self._out.write_event(event)
        if event.kind == "transient":
            self._tally.left_out_samples = int(event.details["samples"])
            self._renew(left_out_samples=self._tally.left_out_samples)

    def _clocked(self) -> Iterator[Block]:
        # The arrival of samples from a file or a pipe does not show when they were taken.
        paced = isinstance(self.source, LiveSource) and self.source.paced and not self.source.waits
        for block in self._blocks:
            if paced and isinstance(block, LiveBlock) and self._relation.take(block):
                self._set_clock()
                for event in self._relation.drain_events():
                    self._out.write_event(event)
            yield block

    def _set_clock(self) -> None:
        """Publish the clock of a live run."""
        pieces = self._relation.clock.pieces
        self.to.audience.set_clock(pieces)
        self._renew(clock=list(pieces))

    def _renew(self, **found: Any) -> None:
        """Write findings during the run to run.json, now and at the end."""
        self._found_on_the_way |= found
        if not isinstance(self.recorder, RunDirectory):
            with suppress(LivebodeError):  # if the disk is full, it is written at the end of the run
                self.recorder.renew(**found)

    def _step(self, step: Callable[[], Responses | None]) -> None:
        """Process one step of the follower, and publish its responses and events."""
        before = time.perf_counter()
        responses = step()
        if responses is not None:
            self._tally.take(responses, time.perf_counter() - before)
            self._publish(responses)
        self._write_events()
        if (kept := self._orders.take_kept()) is not None and not isinstance(self.recorder, RunDirectory):
            self.recorder.keep(kept)

    def _until(self, changing: Callable[[], bool]) -> bool:
        """Called by a live source before each Block and while it waits, to record events of a silent machine."""
        if self._tally.stop and time.monotonic() - self._stepped_s > _SILENT_S:
            self._write_events()
            self._out.report_groups_while_silent(time.monotonic())
            if not isinstance(self.recorder, RunDirectory):
                self.recorder.commit_while_silent()
        return changing()

    def _write_events(self) -> None:
        """Publish events since the last call."""
        self._stepped_s = time.monotonic()
        events = self._drained() + self._follower.drain_events() + self._out.drain_events()
        if self._shedding is not None:
            shed = self._shedding.drain_events(*self.position)
            for event in shed:
                if event.kind != "thinned":
                    self.to.tell(event)
            events += shed
        for event in events + self._orders.drain_events(*self.position):
            self._out.write_event(event)
        self._out.report_groups(self.position[1])

    def _publish(self, responses: Responses) -> None:
        fits, watching = self.pipeline.fits, self.pipeline.watching
        self._overview.add(responses)
        self._out.write(responses)
        parameters = None if fits is None else self._fitted(fits, responses)
        if watching is not None and (self._shedding is None or self._shedding.to_monitor(responses)):
            watching.follow(responses, parameters, self._out.write_event)

    def _fitted(self, fits: Fits, responses: Responses) -> Parameters:
        if self._shedding is None:
            return fits.take(responses, self._out)
        with self._shedding.fitting(responses) as chosen:
            return fits.take(chosen, self._out)

    def _drained(self) -> list[Event]:
        """Events of a live source; a recording has all of them at the start."""
        if not isinstance(self.source, LiveSource):
            return []
        events = self.source.drain_events()
        for event in self._announcing.of(events):
            self.to.tell(event)
        return self._ahead.released([*events], self._tally.stop)

    def end(self, continued_in: str | None = None, *, handed_over: bool = False) -> None:
        """Check the results, and create the summary; `handed_over`: another run continues with the follower.

        Raises
        ------
        SignalError
            If the signals are invalid. In segments they remain recorded if there are responses, and an event reports
            it.
        """
        try:
            self._judge(hand_out=not handed_over)
        except LivebodeError as error:
            if self._kept is None or not (self._tally.responses or self._goes_on or continued_in):
                raise
            # Recorded data remains, with an event that reports the error.
            self._out.write_event(Event("doubtful", *self.position, str(error)))
        left = [] if self._shedding is None else self._shedding.finish(*self.position)
        ended = self._drained() + self._ahead.finish() + self._orders.drain_events(*self.position) + left
        for event in ended:
            self._out.write_event(event)
        fits, watching = self.pipeline.fits, self.pipeline.watching
        self._done = summary.begun(self._about, self._follower, self._begun["found"]["unit"])
        self._done |= summary.done(self._follower, self._tally)
        self._newest = None if fits is None else fits.newest()
        self._done |= summary.of_source(self.source) | summary.fitted(fits, self._newest, self._overview.responses())
        if watching is not None:
            self._done["monitoring"] = watching.finish(self._out.write_event)
        self._out.finish_groups()
        self._done |= self._found_on_the_way
        if continued_in is not None:
            self._done["continued_in"] = continued_in

    def _judge(self, *, hand_out: bool) -> None:
        """Publish delayed results at the end; SignalError if the responses are invalid."""
        follower, tally = self._follower, self._tally
        window = follower.settings.lines.window
        tally.check.finish()
        check_length(follower.counts["samples"], window)
        if hand_out and tally.handed_out != tally.stop:
            self._step(follower.finish)
            tally.handed_out = tally.stop
        check_excitation(follower, tally.check.variance)
        check_some_valid(tally.responses, tally.valid_lines, follower)

    def finish(self) -> Outcome:
        """Draw the pictures and move the record to its place."""
        responses = self._overview.responses()

        def draw(into: Path) -> None:
            if len(responses):
                self.to.draw(responses, into, self._label, self._newest)

        if isinstance(self.recorder, RunDirectory):
            self.recorder.finish(self._done, draw)
        else:
            self.recorder.finish(self._done, draw, ends="continued_in" in self._done)
        return Outcome(self.to.directory, self._done, responses, self._newest)


def _told(blocks: Iterator[Block], audience: Audience) -> Iterator[Block]:
    """The same blocks; `audience` is informed of each when the next one is requested."""
    for block in blocks:
        yield block
        audience.followed(block)


def _health(source: Source) -> Callable[[], Health] | None:
    return (lambda: source.health) if isinstance(source, LiveSource) else None


def _keep_freed_memory() -> None:
    # glibc returns the memory of freed arrays, and requests it again page by page for the next block: a third of the
    # tracker's time. After an array of this size was freed, glibc retains the memory of smaller ones.
    np.empty(31 << 20, dtype=np.uint8)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""
