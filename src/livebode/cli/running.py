"""The work of `livebode run`: configurations from the options, and the runs of recordings or live sources."""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from livebode.cli import terminal
from livebode.cli.failures import exit_code_of
from livebode.cli.next_step import NextCommand
from livebode.cli.notices import NoticePrinter, PercentPrinter
from livebode.cli.options import parsed_band
from livebode.cli.pictures import draw, tracked_amount
from livebode.cli.remote import recorded_at
from livebode.cli.shell import command_line
from livebode.configuration import Axis, ServeSection
from livebode.core import ConfigError, LocationError, RecordError, UsageError
from livebode.estimates import RESPONSE, rule
from livebode.locations import Location, Url, local_copy, location, original
from livebode.records import is_run, to_json
from livebode.runtime import (
    Destination,
    Document,
    Outcome,
    RunStep,
    StoppedError,
    Subscriber,
    TrackerResults,
    run,
)
from livebode.sources import read_head

if TYPE_CHECKING:
    from rich.console import Console

    from livebode.cli.serving import SubscribersOf
    from livebode.configuration import Axes, ConfigurationFile
    from livebode.publishing import Publisher


def run_targets(
    places: list[Location],
    over: dict[str, dict[str, Any]],
    outputs: list[str],
    *,
    output_only: bool,
    band: str | None,
    out: str | None,
    force: bool,
    serve: bool,
    port: int | None,
    as_json: bool,
) -> NextCommand:
    """Run recordings or a configuration, with the sections that the options specify over it; print the result."""
    target = places[0]
    over = over | _output_only(target, output_only, outputs, band)
    if len(places) > 1 and any(place.suffix.lower() == ".toml" for place in places):
        raise UsageError(
            "conflict",
            "a configuration cannot be combined with other arguments",
            "list the recordings in its source.log",
            argument="log",
        )
    each = [] if output_only else outputs
    file = _file(target, over)
    if file is not None and len(each) > 1:
        raise UsageError(
            "conflict",
            "several --output cannot be combined with a configuration",
            "write an axis for each in [axes]",
            argument="output",
        )
    axes: Axes = _axes(places, over, each) if file is None else file.read()
    live = any(axis.source.live for axis in axes.values())
    alone = axes.get("")
    segments = live or any(axis.record is not None for axis in axes.values())
    place: Location = Path("runs") / target.stem
    if out is not None:
        place = location(out)
    elif not force and (live or not segments):  # the record of a recording with a journal continues
        from livebode.runtime import next_run  # needed without a given place only

        place = next_run(Path("runs") / target.stem, axes)
    with recorded_at(place, segments=segments) as (directory, send):
        if alone is None:
            _check_places(directory, axes, force=force)
        entries = {name or target.stem: axis.entries for name, axis in axes.items()} if serve else {}
        if serve and alone is not None and rule(alone.kind, "page") is None:
            raise UsageError(
                "conflict",
                "the dashboard shows responses, and an output-only run has none",
                "run it without the dashboard",
                options=["--output-only", "--serve"],
            )
        shown: AbstractContextManager[SubscribersOf] = nullcontext(lambda _: ())
        section = _serving(axes)
        if serve:
            from livebode.cli.serving import served

            shown = served(section, port, entries, stays=not live)
        with shown as subscribers_of:
            publishing = _published(axes, directory, target.stem, edited=live and file is not None)
            with publishing as publisher:
                if alone is not None and not live:
                    outcome = _run(alone, directory, force, as_json, subscribers_of(target.stem), publisher)
                    send()
                    _show(outcome, alone, as_json)
                else:
                    _run_axes(
                        axes, directory, force, as_json, file,
                        lambda name: subscribers_of(name or target.stem), send, publisher,
                    )  # fmt: skip
    return NextCommand("view" if alone is None else _next_of(alone), place)


def _next_of(axis: Axis) -> str:
    """The command that shows most of a run."""
    if axis.kind != RESPONSE:
        return "view"
    return "fit" if axis.fit is None else "report"


def _check_places(directory: Path, axes: Axes, *, force: bool) -> None:
    """RecordError before anything is written if the runs of several axes cannot be put into this directory."""
    if is_run(directory):
        raise RecordError(
            "exists",
            f"{str(directory)!r} is the directory of a run, so the runs of {', '.join(axes)} are not written into it",
            "choose another path",
            path=str(directory),
            argument="out",
        )
    for place in (directory / name for name in axes):
        if force and os.path.lexists(place):
            from livebode.records import check_removable

            check_removable(place)


@contextmanager
def _published(axes: Axes, directory: Path, alone: str, *, edited: bool) -> Iterator[Publisher | None]:
    """The publisher of these axes; None if none of them publishes, and the file cannot change that (`edited`).

    `alone` is the name under which a single axis publishes.
    """
    if not edited and not any(axis.publish for axis in axes.values()):
        yield None
        return
    from livebode.cli.serving import print_line
    from livebode.publishing import Publisher

    with Publisher(axes, directory.with_name(f"{directory.name}.outbox.sqlite"), print_line, alone=alone) as publisher:
        yield publisher


def _publishing_to(to: Destination, publisher: Publisher | None, name: str) -> Destination:
    """The destination of an axis, with the publisher as a subscriber."""
    if publisher is None:
        return to
    subscribers: tuple[Subscriber, ...] = (*to.subscribers, publisher.subscriber(name))
    return replace(to, subscribers=subscribers, findings=partial(publisher.findings, name))


def _file(target: Location, over: Mapping[str, Mapping[str, Any]]) -> ConfigurationFile | None:
    """The configuration that is run; None for a recording."""
    if target.suffix.lower() != ".toml":
        return None
    if isinstance(target, Url):
        raise LocationError(
            "not-possible",
            f"the configuration {target} is at a URL",
            "copy it to this computer; the recordings that it names may be at URLs",
            path=str(target),
        )
    from livebode.configuration import ConfigurationFile

    return ConfigurationFile(target, over)


def _output_only(target: Location, chosen: bool, outputs: list[str], band: str | None) -> dict[str, Any]:
    """The section of an output-only run; nothing for another one, and UsageError if that has a band."""
    if chosen:
        others = {"others": outputs[1:]} if outputs[1:] else {}
        return {"output_only": others | ({"band_hz": parsed_band(band)} if band else {})}
    if band and (file := _file(target, {})) is not None:
        axes = file.read().values()
        if all(axis.output_only is not None for axis in axes):
            return {"output_only": {"band_hz": parsed_band(band)}}
    if band:
        raise UsageError(
            "conflict",
            "a band belongs to an output-only run",
            "remove it, or add --output-only",
            options=["--band"],
        )
    return {}


def _serving(axes: Axes) -> ServeSection:
    """The dashboard section, which all axes share; ConfigError if they differ."""
    name, first = next(iter(axes.items()))
    for other, axis in axes.items():
        if axis.serve != first.serve:
            raise ConfigError(
                "key-conflict",
                f"axes {name} and {other} have different [serve] sections, but there is one dashboard",
                "write [serve] once, outside [axes]",
                key="serve",
                axes=[name, other],
            )
    return first.serve


def _axes(recordings: list[Location], specified: dict[str, dict[str, Any]], outputs: list[str]) -> Axes:
    """The configuration of recordings; of several outputs one axis for each, with a name that a directory can have."""
    if len(outputs) < 2:
        return {"": _axis(recordings, specified)}
    found: dict[str, Axis] = {}
    for number, output in enumerate(outputs, 1):
        name = re.sub(r"[^A-Za-z0-9_]+", "_", output).strip("_")[:48] or "output"
        if name.casefold() in map(str.casefold, found):
            name = f"{name}_{number}"
        signals = specified.get("signals", {}) | {"output": output}
        found[name] = _axis(recordings, specified | {"signals": signals})
    return found


def _axis(recordings: list[Location], specified: dict[str, dict[str, Any]]) -> Axis:
    """The configuration of recordings from the options; roles are proposed where no channel is named."""
    source, signals = specified.get("source", {}), specified.get("signals", {})
    if not signals.keys() & {"excitation", "input", "output"} and "output_only" not in specified:
        signals, tracking = _proposed_roles(recordings[0], source)
        specified = specified | {
            "signals": specified.get("signals", {}) | signals,
            "tracking": tracking | specified.get("tracking", {}),
        }
    if "output" not in signals:
        for recording in recordings:
            with local_copy(recording) as path:
                read_head(path)  # a file that is missing or a directory is the first thing to mend
        raise _unnamed(recordings[0], "the output channel is not named", "give --output CHANNEL", argument="output")
    log = recordings if len(recordings) > 1 else recordings[0]
    return Axis.of(specified | {"source": source | {"log": log}}, "the options")


def _unnamed(recording: Location, wrong: str, remedy: str, **facts: object) -> UsageError:
    words = command_line("livebode", "inspect", str(recording), "--out", "axis.toml")
    return UsageError("missing", wrong, f"{remedy}; `{words}` lists the channels and proposes their roles", **facts)


def _proposed_roles(recording: Location, source: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, str]]:
    """[signals] and [tracking] of a recording whose channels have unambiguous roles, which are printed.

    UsageError if a role could be that of several channels, or of none.
    """
    from livebode.preparation import Proposals, suitable_estimator
    from livebode.sources import open_log

    remedy, options = "name them by --excitation, --input and --output", ["--excitation", "--input", "--output"]
    log = open_log(recording, rate_hz=source.get("rate_hz"), time=source.get("time"), dbc=source.get("dbc"))
    roles = Proposals(log).roles()
    roles.pop("schedule")
    if missing := [role for role in ("input", "output") if roles[role].channel is None]:
        names = ", ".join(channel.name for channel in log.channels)
        wrong = f"no channel is named, and the {missing[0]} is not recognised among {names}"
        raise _unnamed(recording, wrong, remedy, options=options)
    if doubtful := {role: guess for role, guess in roles.items() if guess.others}:
        role, guess = next(iter(doubtful.items()))
        suitable = " or ".join(map(repr, (guess.channel, *guess.others)))
        raise _unnamed(recording, f"no channel is named, and the {role} could be {suitable}", remedy, options=options)
    signals = {role: guess.channel for role, guess in roles.items() if guess.channel is not None}
    estimator, _ = suitable_estimator(log, signals)
    reasons = ", ".join(f"{role} {name} ({roles[role].reason})" for role, name in signals.items())
    print(f"livebode: roles: {reasons}; --output, --input and --excitation change them", file=sys.stderr)
    return signals, {"estimator": estimator}


def _run(
    axis: Axis,
    directory: Path,
    force: bool,
    quiet: bool,
    subscribers: tuple[Subscriber, ...],
    publisher: Publisher | None,
) -> Outcome:
    """Track one recording."""

    def job(own: tuple[Subscriber, ...]) -> Outcome:
        return run(axis, _publishing_to(Destination(directory, draw, force, (*subscribers, *own)), publisher, ""))

    return _with_progress(job, quiet)


_STEPS = {
    "opening": ("opening the recording", 0.0),
    "lines": ("searching the lines", 0.05),
    "examining": ("examining the recording", 0.4),
    "tracking": ("tracking", 0.65),
    "ending": ("drawing", 0.9),
}
"""Steps of a run with the part of its time that is over then, measured with 200 MB of CSV whose lines are searched."""


class Countdown:
    """The time that remains, as text of the moment at which it is shown; empty as long as it is not known."""

    def __init__(self) -> None:
        self._began_s, self._ends_s = time.monotonic(), nan

    def reach(self, share: float) -> None:
        """This share of the work is done."""
        if share:
            self._ends_s = self._began_s + (time.monotonic() - self._began_s) / share

    def __str__(self) -> str:
        remaining_s = self._ends_s - time.monotonic()
        return "" if isnan(remaining_s) else f"about {max(remaining_s, 1.0):.0f} s remain"


def _with_progress(job: Callable[[tuple[Subscriber, ...]], Outcome], quiet: bool) -> Outcome:
    """Run a job whose subscribers show notices and, on a terminal, a progress bar."""
    if quiet or not terminal.is_terminal(stderr=True):
        notices = NoticePrinter(lambda message: _print_notice(terminal.console(stderr=True), message))
        return job((notices, PercentPrinter()) if terminal.prints_percent else (notices,))
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[countdown]}"),
    )
    with Progress(*columns, console=terminal.console(stderr=True), transient=True) as bar:
        countdown = Countdown()
        task = bar.add_task(_STEPS["opening"][0], total=1.0, countdown=countdown)

        def show(done: float, description: str | None = None) -> None:
            countdown.reach(done)
            bar.update(task, completed=done, description=description)

        def show_progress(document: Document) -> None:
            if isinstance(document, RunStep):
                description, done = _STEPS[document.name]
                show(done, description=description)
            elif isinstance(document, TrackerResults) and document.samples_total:
                begin, end = _STEPS["tracking"][1], _STEPS["ending"][1]
                show(begin + (end - begin) * document.samples / document.samples_total)

        return job((show_progress, NoticePrinter(lambda message: _print_notice(bar.console, message))))


def _print_notice(console: Console, message: str) -> None:
    console.print(f"livebode: {message}", highlight=False, markup=False)


def _run_axes(
    axes: Axes,
    directory: Path,
    force: bool,
    as_json: bool,
    file: ConfigurationFile | None,
    subscribers_of: SubscribersOf,
    send: Callable[[], None],
    publisher: Publisher | None,
) -> None:
    """Track live sources or several axes until all have ended."""
    from livebode.cli.axes_terminal import AxesTerminal, plain
    from livebode.runtime import Session

    def to(name: str, _: Axis) -> Destination:
        subscribers = (*subscribers_of(name), shown.subscriber(name))
        return _publishing_to(Destination(directory / name, draw, force, subscribers), publisher, name)

    gc.freeze()  # what is loaded remains: a search through it would stop all axes for tens of milliseconds
    shown = AxesTerminal(quiet=as_json)
    prepare = {} if publisher is None else {"prepare": publisher.prepare}
    session = Session(axes, to, report=shown.print_event, leave=shown.leave, file=file, **prepare)
    shown.run(session)
    send()
    if session.ended_by and all(thread.ended_early for thread in session.all):
        raise KeyboardInterrupt if session.ended_by == signal.SIGINT else SystemExit(128 + session.ended_by)
    if "" in session.threads:
        _show(session.threads[""].result(), axes[""], as_json)
        return
    if as_json:
        print(to_json({"axes": plain(session)}))
    for thread in session.all:
        if thread.outcome is not None and not as_json:
            print(
                f"{thread.name}: {tracked_amount(thread.outcome.summary)}\n{original(str(thread.outcome.directory))}/"
            )
    errors = [thread.error for thread in session.all if thread.error is not None and not thread.ended_early]
    if errors:
        raise typer.Exit(exit_code_of([error for error in errors if not isinstance(error, StoppedError)]))


def _show(outcome: Outcome, axis: Axis, as_json: bool) -> None:
    if as_json:
        print(to_json({"directory": original(str(outcome.directory))} | outcome.summary), flush=True)
    else:
        rule(axis.kind, "show")(outcome)
