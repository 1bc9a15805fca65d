"""One run: a recording through the tracker into its directory."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from livebode.estimation import Settings, Tracker, response_unit
from livebode.kernel import instruction_set
from livebode.nouns import Block, Channel, Event, InputError, Responses
from livebode.records import RunDirectory
from livebode.session.axis import Axis, RecordSection
from livebode.session.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.session.overview import Overview
from livebode.session.plan import make_settings
from livebode.session.tally import Tally
from livebode.sources import open_log

if TYPE_CHECKING:
    from livebode.session.segmented import SegmentedRun

Progress = Callable[[int, int | None], None]
Watch = Callable[[Responses], None]
Draw = Callable[[Responses, Path, str], None]
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
    """What a run came to: its directory, its summary as in run.json, and a thinned copy of its responses."""

    directory: Path
    summary: dict[str, Any]
    responses: Responses


def run(
    axis: Axis,
    directory: Path,
    *,
    force: bool = False,
    progress: Progress,
    draw: Draw,
    tell: Tell = lambda _: None,
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
        Called with the thinned responses, the directory before it is put in place, and the scheduling signal's name
        with its unit, to add pictures.
    tell
        Called with what the record in segments itself has to say: that it goes on, pauses or removes what is oldest.

    Raises
    ------
    InputError
        For anything in the recording or the configuration that cannot be; nothing is left in `directory` then, or in
        segments all that was recorded so far.
    """
    started = time.perf_counter()
    log = open_log(axis.source.log, rate_hz=axis.source.rate_hz, time=axis.source.time)
    settings = make_settings(axis, log)
    found = {"format": log.format, "rate_from": log.rate_origin}
    about = {"configuration": axis.model_dump(mode="json"), "found": found}
    return record(
        log,
        settings,
        directory,
        about=about,
        force=force,
        progress=progress,
        draw=draw,
        started=started,
        kept=axis.record,
        tell=tell,
    )


def record(
    source: Source,
    settings: Settings,
    directory: Path,
    *,
    about: dict[str, Any],
    force: bool,
    progress: Progress,
    draw: Draw,
    watch: Watch | None = None,
    started: float | None = None,
    kept: RecordSection | None = None,
    again: bool = True,
    tell: Tell = lambda _: None,
    **delivery: Any,
) -> Outcome:
    """Track a source and leave a run directory; `about` is what run.json says of it besides.

    `watch` is called with each new batch of responses; `started` (perf_counter) is when opening the source began, where
    that is to count in the speed; `kept` asks for a record in segments, which goes on where it ended, and which `tell`
    hears of; `again` says whether the source begins with the same samples each time; `delivery` goes to its `blocks`.
    """
    started = time.perf_counter() if started is None else started
    _keep_freed_memory()
    tracker, overview = Tracker(settings), Overview()
    signals = [name for role in settings.roles if (name := settings.channel(role))]
    wanted = list(dict.fromkeys(signals + ([settings.schedule] if settings.schedule else [])))
    blocks = source.blocks(wanted, **delivery)
    channels = {channel.name: channel for channel in source.channels}
    tally = Tally(ChannelCheck(tuple(signals), settings.channel(settings.method.reference) or ""), started)
    about = _summary(about, settings, response_unit(source.channels, settings))

    def publish(responses: Responses) -> None:
        overview.add(responses)
        out.write(responses)
        if watch is not None:
            watch(responses)

    def drawn(into: Path) -> None:
        draw(overview.responses(), into, _schedule_label(source, settings.schedule))

    out: RunDirectory | SegmentedRun
    if kept is None:
        out = RunDirectory(directory, force=force)
    else:
        from livebode.session.segmented import SegmentedRun  # needs a POSIX system

        out = SegmentedRun(
            directory,
            kept,
            summary=about,
            channels=[channels[name] for name in wanted],
            rate_hz=settings.lines.rate_hz,
            parts={"tracker": tracker, "tally": tally},
            force=force,
            again=again,
            ends=source.samples is not None,
            tell=tell,
        )
    with out:
        if not isinstance(out, RunDirectory):
            for responses in out.before():
                overview.add(responses)
            blocks = out.feed(blocks)
        _track(source, blocks, tracker, tally, publish, out, progress)
        _judge(tracker, tally, None if kept is None else out.write_event)
        summary = about | _done(tracker, tally)
        out.finish(summary, drawn)
    return Outcome(directory, summary, overview.responses())


def _track(
    source: Source,
    blocks: Iterator[Block],
    tracker: Tracker,
    tally: Tally,
    publish: Watch,
    out: RunDirectory | SegmentedRun,
    progress: Progress,
) -> None:
    """Every block through the tracker into the record."""
    for block in blocks:
        tally.check.take(block)
        before = time.perf_counter()
        responses = tracker.process(block)
        tally.take(block, responses, time.perf_counter() - before)
        publish(responses)
        for event in tracker.drain_events():
            out.write_event(event)
        progress(tracker.counts["samples"], source.samples)
    if not tally.stop:
        raise InputError("the recording holds no samples")


def _judge(tracker: Tracker, tally: Tally, say: Tell | None) -> None:
    """InputError where the responses mean nothing; with `say` an Event, since what was recorded stays."""
    lines = tracker.settings.lines
    try:
        tally.check.finish()
        check_length(tally.stop, lines.window)
        check_excitation(tracker, tally.check.variance)
        check_some_valid(tally.responses, tally.valid_lines, tracker.counts, lines.window)
    except InputError as error:
        if say is None:
            raise
        say(Event("check", tally.stop, tally.stop / lines.rate_hz, str(error)))


def _keep_freed_memory() -> None:
    # glibc gives the memory of freed arrays back, and takes it again page by page for the next block: a third of the
    # tracker's time. Once an array of this size was freed, it keeps what smaller ones leave.
    np.empty(31 << 20, dtype=np.uint8)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""


def _summary(about: dict[str, Any], settings: Settings, unit: str) -> dict[str, Any]:
    """What run.json says from the beginning."""
    lines = settings.lines
    found = {
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "frequency_hz": lines.frequency_hz.tolist(),
        "bins": list(lines.bins),
        "quiet_bins": list(lines.quiet),
        "hop": settings.step,
        "quantity": settings.quantity,
        "unit": unit,
    }
    versions = {
        "livebode": version("livebode"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
    }
    return about | {"found": about.get("found", {}) | found, "versions": versions}


def _done(tracker: Tracker, tally: Tally) -> dict[str, Any]:
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
