"""One run: a recording through the tracker into its directory."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from livebode.estimation import Settings, Tracker
from livebode.kernel import instruction_set
from livebode.nouns import Block, Channel, InputError, Responses
from livebode.records import RunDirectory
from livebode.session.axis import Axis
from livebode.session.checks import ChannelCheck, check_excitation, check_length, check_some_valid
from livebode.session.overview import Overview
from livebode.session.plan import make_settings
from livebode.session.watching import Watching, make_watching
from livebode.sources import open_log

Progress = Callable[[int, int | None], None]
Watch = Callable[[Responses], None]
Draw = Callable[[Responses, Path, str], None]


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
        Called with the thinned responses, the directory before it is put in place, and the scheduling signal's name
        with its unit, to add pictures.

    Raises
    ------
    InputError
        For anything in the recording or the configuration that cannot be; nothing is left in `directory` then.
    """
    started = time.perf_counter()
    log = open_log(axis.source.log, rate_hz=axis.source.rate_hz, time=axis.source.time)
    settings = make_settings(axis, log)
    found = {"format": log.format, "rate_from": log.rate_origin}
    about = {"configuration": axis.model_dump(mode="json"), "found": found}
    watching = make_watching(axis.monitoring, settings)
    return record(
        log, settings, directory, about=about, force=force, progress=progress, draw=draw, watching=watching,
        started=started,
    )  # fmt: skip


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
    watching: Watching | None = None,
    started: float | None = None,
    **delivery: Any,
) -> Outcome:
    """Track a source and leave a run directory; `about` is what run.json says of it besides.

    `watch` is called with each new batch of responses; `watching` tells changes; `started` (perf_counter) is when
    opening the source began, where that is to count in the speed; `delivery` goes to the source's `blocks`.
    """
    started = time.perf_counter() if started is None else started
    _keep_freed_memory()
    tracker, overview = Tracker(settings), Overview()
    with RunDirectory(directory, force=force) as out:

        def publish(responses: Responses) -> None:
            overview.add(responses)
            out.write(responses)
            if watch is not None:
                watch(responses)

        counts, tracked_s = _track(source, tracker, publish, out, progress, delivery, watching)
        responses = overview.responses()
        summary = _summary(about, tracker, responses) | {"counts": counts}
        if watching is not None:
            summary["monitoring"] = watching.finish(out.write_event)
        summary["speed"] = _speed(tracker, tracked_s, time.perf_counter() - started)
        out.write_summary(summary)
        draw(responses, out.partial, _schedule_label(source, settings.schedule))
    return Outcome(directory, summary, responses)


def _track(
    source: Source,
    tracker: Tracker,
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
    block: Block | None = None
    for block in source.blocks(wanted, **delivery):
        check.take(block)
        before = time.perf_counter()
        responses = tracker.process(block)
        tracked_s += time.perf_counter() - before
        totals += len(responses), np.count_nonzero(~responses.valid.all(axis=1)), np.count_nonzero(responses.valid)
        publish(responses)
        for event in tracker.drain_events():
            out.write_event(event)
        if watching is not None:
            watching.take(block, responses, out.write_event)
        progress(tracker.counts["samples"], source.samples)
    if block is None:
        raise InputError("the recording holds no samples")
    check.finish()
    check_length(block.stop, settings.lines.window)
    check_excitation(tracker, check.variance)
    total, invalid, valid = (int(n) for n in totals)
    check_some_valid(total, valid, tracker.counts, settings.lines.window)
    return tracker.counts | {"responses": total, "invalid_responses": invalid}, tracked_s


def _keep_freed_memory() -> None:
    # glibc gives the memory of freed arrays back, and takes it again page by page for the next block: a third of the
    # tracker's time. Once an array of this size was freed, it keeps what smaller ones leave.
    np.empty(31 << 20, dtype=np.uint8)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""


def _summary(about: dict[str, Any], tracker: Tracker, responses: Responses) -> dict[str, Any]:
    settings, lines = tracker.settings, tracker.settings.lines
    found = {
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "frequency_hz": lines.frequency_hz.tolist(),
        "bins": list(lines.bins),
        "quiet_bins": list(lines.quiet),
        "hop": settings.step,
        "quantity": responses.quantity,
        "unit": responses.unit,
    }
    versions = {
        "livebode": version("livebode"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
    }
    return about | {"found": about.get("found", {}) | found, "versions": versions}


def _speed(tracker: Tracker, tracked_s: float, whole_s: float) -> dict[str, float]:
    samples = tracker.counts["samples"]
    recorded_s = samples / tracker.settings.lines.rate_hz
    return {
        "recorded_s": recorded_s,
        "run_s": whole_s,
        "tracking_s": tracked_s,
        "times_real_time": recorded_s / whole_s,
        "samples_per_s": samples / tracked_s,
    }
