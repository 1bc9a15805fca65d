"""One run: a recording through the tracker into its directory."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from livebode.estimation import response_unit
from livebode.fitting import Fit
from livebode.kernel import instruction_set
from livebode.nouns import Block, Channel, Event, InputError, Model, Responses
from livebode.records import RunDirectory
from livebode.session.audience import Audience, Outlet
from livebode.session.axis import Axis, RecordSection
from livebode.session.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.session.fits import Fits
from livebode.session.follower import Follower
from livebode.session.loop_report import loop_report
from livebode.session.overview import Overview
from livebode.session.plan import make_follower
from livebode.session.tally import Tally
from livebode.session.watching import Watching, make_watching
from livebode.sources import open_log
from livebode.sources.live import Health, LiveSource

if TYPE_CHECKING:
    from livebode.session.segmented import SegmentedRun

Progress = Callable[[int, int | None], None]
Publish = Callable[[Responses], None]
Draw = Callable[[Responses, Path, str, Model | None], None]
Tell = Callable[[Event], None]


class Source(Protocol):
    """What a run takes its samples from: a recording or a simulated machine."""

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def samples(self) -> int | None: ...

    @property
    def blocks(self) -> Callable[..., Iterator[Block]]: ...


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a run came to: its directory, its summary as in run.json, a thinned copy of its responses, and the newest
    fit that holds."""

    directory: Path
    summary: dict[str, Any]
    responses: Responses
    fit: Fit | None = None


def run(
    axis: Axis,
    directory: Path,
    *,
    force: bool = False,
    progress: Progress,
    draw: Draw,
    tell: Tell = lambda _: None,
    audience: Audience | None = None,
) -> Outcome:
    """Track a recording and leave a run directory.

    Parameters
    ----------
    axis
        Recording, signals, lines and options.
    directory
        Where the run is to stand; appears only when whole, unless [record] asks for segments: then it is there from
        the beginning, and an unfinished one of this axis is gone on with.
    force
        Replace an earlier run there.
    progress
        Called after each block with samples done and in all (None where not known).
    draw
        Called with the thinned responses, the directory before it is put in place, the scheduling signal's name
        with its unit, and the newest fit, to add pictures.
    tell
        Called with what the record in segments itself has to say: that it goes on, pauses or removes what is oldest.
    audience
        Sees all that the run publishes.

    Raises
    ------
    InputError
        For anything in the recording or the configuration that cannot be; nothing is left in `directory` then, or in
        segments all that was recorded so far.
    """
    started = time.perf_counter()
    assert axis.source.log is not None
    log = open_log(axis.source.log, rate_hz=axis.source.rate_hz, time=axis.source.time)
    tracker = make_follower(axis, log)
    found = {"format": log.format, "rate_from": log.rate_origin}
    about = {"configuration": axis.model_dump(mode="json", exclude={"serve"}), "found": found}
    fits = Fits.of(axis.fit, tracker.settings.loop)
    watching = make_watching(axis, tracker.settings)
    return record(
        log,
        tracker,
        directory,
        about=about,
        force=force,
        progress=progress,
        draw=draw,
        started=started,
        fits=fits,
        watching=watching,
        kept=axis.record,
        tell=tell,
        audience=audience,
    )


def record(
    source: Source,
    tracker: Follower,
    directory: Path,
    *,
    about: dict[str, Any],
    force: bool,
    progress: Progress,
    draw: Draw,
    audience: Audience | None = None,
    watching: Watching | None = None,
    started: float | None = None,
    fits: Fits | None = None,
    kept: RecordSection | None = None,
    again: bool = True,
    tell: Tell = lambda _: None,
    **delivery: Any,
) -> Outcome:
    """Track a source and leave a run directory; `about` is what run.json says of it besides.

    `audience` sees all that is published; `started` (perf_counter) is when opening the source began, where that is to
    count in the speed; `fits` are made of every response; `watching` tells changes; `kept` asks for a record in
    segments, which goes on where it ended, and which `tell` hears of; `again` says whether the source begins with the
    same samples each time; `delivery` goes to its `blocks`.
    """
    _keep_freed_memory()
    settings, overview, audience = tracker.settings, Overview(), audience or Audience()
    signals = [name for role in settings.roles if (name := settings.channel(role))]
    wanted = list(dict.fromkeys(signals + ([settings.schedule] if settings.schedule else [])))
    blocks = source.blocks(wanted, **delivery)
    check = ChannelCheck(tuple(signals), settings.channel(settings.method.reference) or "")
    tally = Tally(check, time.perf_counter() if started is None else started)
    label = _schedule_label(source, settings.schedule)
    about = about | {"found": about.get("found", {}) | {"schedule": label}}
    begun = _begun(about, tracker, response_unit(source.channels, settings))
    channels = {channel.name: channel for channel in source.channels}

    def said(event: Event) -> None:
        tell(event)
        audience.write_event(event)

    recorder = _recorder(
        directory,
        kept,
        force,
        summary=begun,
        channels=[channels[name] for name in wanted],
        rate_hz=settings.lines.rate_hz,
        parts={"tracker": tracker, "tally": tally} | {k: p for k, p in (("fits", fits), ("watching", watching)) if p},
        again=again,
        ends=source.samples is not None,
        tell=said,
    )
    out = Outlet(recorder, audience)

    def publish(responses: Responses) -> None:
        overview.add(responses)
        out.write(responses)
        parameters = None if fits is None else fits.take(responses, out)
        if watching is not None:
            watching.follow(responses, parameters, out.write_event)

    with recorder:
        audience.begin(directory, begun | ({} if kept is None else {"record": {"finished": False}}), _health(source))
        if not isinstance(recorder, RunDirectory):
            for responses in recorder.before():
                overview.add(responses)
                audience.write(responses)
                if fits is not None:
                    fits.take(responses[0:0], out)  # which tells it the lines
            blocks = recorder.feed(blocks)
        if watching is not None:
            blocks = watching.over(blocks, out.write_event)
        blocks = _told(blocks, audience)
        _track(source, blocks, tracker, tally, publish, out, progress, None if kept is None else out.write_event)
        summary = _begun(about, tracker, begun["found"]["unit"]) | _done(tracker, tally)
        newest = None if fits is None else fits.newest()
        summary |= _said(source) | _fitted(fits, newest, overview.responses())
        if watching is not None:
            summary["monitoring"] = watching.finish(out.write_event)
        recorder.finish(summary, lambda into: draw(overview.responses(), into, label, newest))
    audience.finish(summary)
    return Outcome(directory, summary, overview.responses(), newest)


def _recorder(
    directory: Path, kept: RecordSection | None, force: bool, **of_segments: Any
) -> RunDirectory | SegmentedRun:
    if kept is None:
        return RunDirectory(directory, force=force)
    from livebode.session.segmented import SegmentedRun  # needs a POSIX system

    return SegmentedRun(directory, kept, force=force, **of_segments)


def _track(
    source: Source,
    blocks: Iterator[Block],
    tracker: Follower,
    tally: Tally,
    publish: Publish,
    out: Outlet,
    progress: Progress,
    say: Tell | None,
) -> None:
    """Every block through the tracker into the record; where the signals mean nothing, `say` or InputError says so."""

    def follow(step: Callable[[], Responses | None]) -> None:
        """Take one step and publish its responses and events."""
        before = time.perf_counter()
        responses = step()
        if responses is not None:
            tally.take(responses, time.perf_counter() - before)
            publish(responses)
        for event in [*drained(source), *tracker.drain_events(), *out.drain_events()]:
            out.write_event(event)

    for block in blocks:
        tally.check.take(block)
        tally.stop = block.stop
        follow(partial(tracker.process, block))
        progress(tracker.counts["samples"], source.samples)
    if not tally.stop:
        raise InputError("the recording holds no samples")
    try:
        _judge(tracker, tally, partial(follow, tracker.finish))
    except InputError as error:
        if say is None or not tally.responses:
            raise
        # What was recorded stays, and says what is wrong with it.
        say(Event("doubtful", tally.stop, tally.stop / tracker.settings.lines.rate_hz, str(error)))
    for event in drained(source):
        out.write_event(event)


def _judge(tracker: Follower, tally: Tally, hand_out: Callable[[], None]) -> None:
    """Hand out what is held back at the end; InputError where the responses mean nothing."""
    window = tracker.settings.lines.window
    tally.check.finish()
    check_length(tally.stop, window)
    if tally.handed_out != tally.stop:
        hand_out()
        tally.handed_out = tally.stop
    check_excitation(tracker, tally.check.variance)
    check_some_valid(tally.responses, tally.valid_lines, tracker.counts, window)


def _told(blocks: Iterator[Block], audience: Audience) -> Iterator[Block]:
    """The same blocks; `audience` hears of each when the next one is asked for."""
    for block in blocks:
        yield block
        audience.followed(block)


def _health(source: Source) -> Callable[[], Health] | None:
    return (lambda: source.health) if isinstance(source, LiveSource) else None


def drained(source: Source) -> list[Event]:
    """What a live source has to say; a recording says it all at once."""
    return source.drain_events() if isinstance(source, LiveSource) else []


def _said(source: Source) -> dict[str, Any]:
    """What run.json says of a live source."""
    if not isinstance(source, LiveSource):
        return {}
    return {"source": asdict(source.health) | {"first_sample": source.first_sample}}


def _fitted(fits: Fits | None, newest: Fit | None, responses: Responses) -> dict[str, Any]:
    """What run.json says of the fits."""
    if fits is None:
        return {}
    summary = {"fit": fits.summary()}
    if newest is not None and fits.loop is not None:
        words = f"newest fit, at {newest.parameters.time_s[0]:.6g} s"
        summary["loop"] = loop_report(newest, words, responses, fits.loop, fits.section).plain()
    return summary


def _keep_freed_memory() -> None:
    # glibc gives the memory of freed arrays back, and takes it again page by page for the next block: a third of the
    # tracker's time. Once an array of this size was freed, it keeps what smaller ones leave.
    np.empty(31 << 20, dtype=np.uint8)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""


def _begun(about: dict[str, Any], tracker: Follower, unit: str) -> dict[str, Any]:
    """What run.json says from the beginning."""
    found = tracker.found() | {"quantity": tracker.settings.quantity, "unit": unit}
    versions = {
        "livebode": version("livebode"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
    }
    return about | {"found": about.get("found", {}) | found, "versions": versions}


def _done(tracker: Follower, tally: Tally) -> dict[str, Any]:
    """What run.json says at the end."""
    samples, run_s = tracker.counts["samples"], tally.run_s
    recorded_s = samples / tracker.settings.lines.rate_hz
    speed = {
        "recorded_s": recorded_s,
        "run_s": run_s,
        "tracking_s": tally.tracked_s,
        "times_real_time": recorded_s / run_s,
        "samples_per_s": samples / tally.tracked_s,
    }
    counts = tracker.counts | {"responses": tally.responses, "invalid_responses": tally.invalid}
    return {"counts": counts, "speed": speed}
