"""One run: a recording through the tracker into its directory."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from livebode.fitting import Fit
from livebode.kernel import instruction_set
from livebode.nouns import Block, Channel, Event, InputError, Model, Responses
from livebode.records import RunDirectory
from livebode.session.axis import Axis
from livebode.session.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.session.fits import Fits
from livebode.session.follower import Follower
from livebode.session.loop_report import loop_report
from livebode.session.overview import Overview
from livebode.session.plan import make_follower
from livebode.session.watching import Watching, make_watching
from livebode.sources import open_log
from livebode.sources.live import LiveSource

Progress = Callable[[int, int | None], None]
Watch = Callable[[Responses], None]
Draw = Callable[[Responses, Path, str, Model | None], None]


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


def run(axis: Axis, directory: Path, *, force: bool = False, progress: Progress, draw: Draw) -> Outcome:
    """Track a recording and leave a run directory.

    Parameters
    ----------
    axis
        Recording, signals, lines and options.
    directory
        Where the run is to stand; appears only when whole.
    force
        Replace an earlier run there.
    progress
        Called after each block with samples done and in all (None where not known).
    draw
        Called with the thinned responses, the directory before it is put in place, the scheduling signal's name
        with its unit, and the newest fit, to add pictures.

    Raises
    ------
    InputError
        For anything in the recording or the configuration that cannot be; nothing is left in `directory` then.
    """
    started = time.perf_counter()
    assert axis.source.log is not None
    log = open_log(axis.source.log, rate_hz=axis.source.rate_hz, time=axis.source.time)
    tracker = make_follower(axis, log)
    found = {"format": log.format, "rate_from": log.rate_origin}
    about = {"configuration": axis.model_dump(mode="json"), "found": found}
    fits = Fits.of(axis.fit, tracker.settings.loop)
    watching = make_watching(axis, tracker.settings)
    return record(
        log, tracker, directory, about=about, force=force, progress=progress, draw=draw, started=started, fits=fits,
        watching=watching,
    )  # fmt: skip


def record(
    source: Source,
    tracker: Follower,
    directory: Path,
    *,
    about: dict[str, Any],
    force: bool,
    progress: Progress,
    draw: Draw,
    watch: Watch | None = None,
    watching: Watching | None = None,
    started: float | None = None,
    fits: Fits | None = None,
    **delivery: Any,
) -> Outcome:
    """Track a source and leave a run directory; `about` is what run.json says of it besides.

    `watch` is called with each new batch of responses, of a correction once a chunk; `started` (perf_counter) is when
    opening the source began, where that is to count in the speed; `fits` are made of every response; `watching` tells
    changes; `delivery` goes to the source's `blocks`.
    """
    started = time.perf_counter() if started is None else started
    _keep_freed_memory()
    overview = Overview()
    with RunDirectory(directory, force=force) as out:

        def publish(responses: Responses) -> None:
            overview.add(responses)
            out.write(responses)
            parameters = None if fits is None else fits.take(responses, out)
            if watching is not None:
                watching.follow(responses, parameters, out.write_event)
            if watch is not None and len(responses):
                watch(responses)

        counts, tracked_s = _track(source, tracker, publish, out, progress, delivery, watching)
        responses = overview.responses()
        summary = _summary(about, tracker, responses) | {"counts": counts}
        if isinstance(source, LiveSource):
            summary["source"] = asdict(source.health) | {"first_sample": source.first_sample}
        if watching is not None:
            summary["monitoring"] = watching.finish(out.write_event)
        summary["speed"] = _speed(tracker, tracked_s, time.perf_counter() - started)
        newest = None
        if fits is not None:
            newest, summary["fit"] = fits.newest(), fits.summary()
            if newest is not None and fits.loop is not None:
                words = f"newest fit, at {newest.parameters.time_s[0]:.6g} s"
                summary["loop"] = loop_report(newest, words, responses, fits.loop, fits.section).plain()
        out.write_summary(summary)
        draw(responses, out.partial, _schedule_label(source, tracker.settings.schedule), newest)
    return Outcome(directory, summary, responses, newest)


def _track(
    source: Source,
    tracker: Follower,
    publish: Watch,
    out: RunDirectory,
    progress: Progress,
    delivery: dict[str, Any],
    watching: Watching | None,
) -> tuple[dict[str, int], float]:
    """Counts of samples and responses, and seconds spent in the tracker."""
    settings, tracked_s, totals = tracker.settings, 0.0, np.zeros(3, dtype=int)
    channels = [name for role in settings.roles if (name := settings.channel(role))]
    check = ChannelCheck(tuple(channels), settings.channel(settings.method.reference) or "")
    wanted = list(dict.fromkeys(channels + ([settings.schedule] if settings.schedule else [])))

    def follow(step: Callable[[], Responses | None]) -> float:
        """Seconds of one step, whose responses and events are published."""
        before = time.perf_counter()
        responses = step()
        took_s = time.perf_counter() - before
        if responses is not None:
            totals[:] += (
                len(responses), np.count_nonzero(~responses.valid.all(axis=1)), np.count_nonzero(responses.valid)
            )  # fmt: skip
            publish(responses)
        for event in [*drained(source), *tracker.drain_events()]:
            out.write_event(event)
        return took_s

    block: Block | None = None
    for block in source.blocks(wanted, **delivery):
        check.take(block)
        if watching is not None:
            watching.take(block, out.write_event)
        tracked_s += follow(partial(tracker.process, block))
        progress(tracker.counts["samples"], source.samples)
    if block is None:
        raise InputError("the recording holds no samples")
    tracked_s += follow(tracker.finish)
    try:
        check.finish()
        check_length(block.stop, settings.lines.window)
        check_excitation(tracker, check.variance)
        check_some_valid(int(totals[0]), int(totals[2]), tracker.counts, settings.lines.window)
    except InputError as error:
        if not (isinstance(source, LiveSource) and totals[0]):
            raise
        # What a machine did cannot be had again: the run stays, and says what is wrong with it.
        out.write_event(Event("doubtful", block.stop, block.time_s[-1], str(error)))
    for event in drained(source):
        out.write_event(event)
    return tracker.counts | {"responses": int(totals[0]), "invalid_responses": int(totals[1])}, tracked_s


def drained(source: Source) -> list[Event]:
    """What a live source has to say; a recording says it all at once."""
    return source.drain_events() if isinstance(source, LiveSource) else []


def _keep_freed_memory() -> None:
    # glibc gives the memory of freed arrays back, and takes it again page by page for the next block: a third of the
    # tracker's time. Once an array of this size was freed, it keeps what smaller ones leave.
    np.empty(31 << 20, dtype=np.uint8)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""


def _summary(about: dict[str, Any], tracker: Follower, responses: Responses) -> dict[str, Any]:
    found = tracker.found() | {"quantity": responses.quantity, "unit": responses.unit}
    versions = {
        "livebode": version("livebode"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
    }
    return about | {"found": about.get("found", {}) | found, "versions": versions}


def _speed(tracker: Follower, tracked_s: float, whole_s: float) -> dict[str, float]:
    samples = tracker.counts["samples"]
    recorded_s = samples / tracker.settings.lines.rate_hz
    return {
        "recorded_s": recorded_s,
        "run_s": whole_s,
        "tracking_s": tracked_s,
        "times_real_time": recorded_s / whole_s,
        "samples_per_s": samples / tracked_s,
    }
