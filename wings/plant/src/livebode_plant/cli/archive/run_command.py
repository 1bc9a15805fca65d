"""`livebode archive run`: track the recordings of an archive that its lake does not have yet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import typer

from livebode.cli import Json, NextCommand, check_use, console
from livebode_plant.cli.archive.selection import LakeOf

if TYPE_CHECKING:
    from livebode_plant.archive.archived_recordings import TrackingFailure
    from livebode_plant.archive.coordinator import ArchiveOutcome, Coordinator, Progress


def run_command(
    context: typer.Context,
    archive: LakeOf,
    retry: Annotated[
        Literal["all", "older"] | None,
        typer.Option(
            help="Track recordings in quarantine again instead, each in a process of its own: all, or those that an "
            "older version of livebode could not track."
        ),
    ] = None,
    compact: Annotated[
        bool,
        typer.Option(
            "--compact", help="Join the small files of the lake instead, and remove files that belong to no result."
        ),
    ] = False,
    as_json: Json = False,
) -> NextCommand:
    """Track the recordings of an archive that its lake does not have yet.

    A recording that cannot be tracked goes to quarantine with the reason. Ctrl-C ends with whole results; the same
    command continues. Files that no table has are removed by --compact when they are older than a week: an archive that
    runs now loses none. A table with results that are not complete is left as it is.
    """
    check_use(context, "--compact", ())
    if compact:
        _compact(archive, as_json=as_json)
    elif retry is not None:
        track(Path(archive), lambda coordinator: coordinator.retry(retry == "older"), as_json=as_json)
    else:
        track(Path(archive), lambda coordinator: coordinator.run(), as_json=as_json)
    return NextCommand("archive", "list", archive)


def _compact(archive: str, *, as_json: bool) -> None:
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake, compact

    results = compact(Lake(lake_url(archive)))
    if as_json:
        print(to_json({"tables": [vars(result) for result in results]}))
        return
    for result in results:
        print(f"{result.table}: {result.before:,} files, now {result.after:,}; {result.removed:,} old ones removed")
        if result.open_results:
            remark = f"{result.open_results:,} results are not complete: let the archive run to its end first"
            print(f"livebode: {result.table}: files not joined; {remark}", file=sys.stderr)


_SHOWN = 10


class ArchiveProgress:
    """A bar with the time that remains, by bytes; without a terminal nothing."""

    def __init__(self, *, quiet: bool) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        terminal = console(stderr=True)
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            TextColumn("remaining"),
            TimeRemainingColumn(),
            console=terminal,
            transient=True,
            disable=quiet or not terminal.is_terminal,
        )
        self._stages: dict[str, Any] = {}
        self._dashboard = ""

    def report(self, progress: Progress) -> None:
        """Show how far it is."""
        if progress.dashboard and progress.dashboard != self._dashboard:
            self._dashboard = progress.dashboard
            self._bar.console.print(f"Dask's dashboard: {progress.dashboard}", highlight=False, markup=False)
        count = f"{progress.done} of {progress.total}"
        if progress.stage not in self._stages:
            self._stages[progress.stage] = self._bar.add_task(progress.stage, total=progress.total_bytes, count=count)
        self._bar.update(self._stages[progress.stage], completed=progress.done_bytes, count=count)

    def __enter__(self) -> Self:
        self._bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.__exit__(kind, error, trace)


def track(archive: Path, work: Callable[[Coordinator], ArchiveOutcome], *, as_json: bool) -> None:
    """Do this with the coordinator of an archive, and print its progress and the result."""
    from livebode_plant.archive.archive_settings import ArchiveSettings
    from livebode_plant.archive.coordinator import Coordinator

    started, settings = time.monotonic(), ArchiveSettings.read(archive)
    with ArchiveProgress(quiet=as_json) as progress:
        outcome = work(Coordinator(settings, progress.report))
    _show(outcome, settings.lake, str(archive), time.monotonic() - started, as_json=as_json)
    if outcome.stopped:
        raise typer.Exit(130)


def _show(outcome: ArchiveOutcome, lake: str, archive: str, seconds: float, *, as_json: bool) -> None:
    """Print the result."""
    from livebode.records import to_json

    if as_json:
        bad = {name: [_plain(failure) for failure in getattr(outcome, name)] for name in ("quarantined", "unreadable")}
        numbers = ("recordings", "known", "tracked", "stopped", "remaining")
        print(to_json({"lake": lake} | {name: getattr(outcome, name) for name in numbers} | bad))
        return
    parts = [f"{outcome.recordings:,} recordings", f"{outcome.known:,} known", f"{outcome.tracked:,} tracked"]
    parts += [f"{len(outcome.quarantined):,} to quarantine"] if outcome.quarantined else []
    parts += [f"{len(outcome.unreadable):,} not readable"] if outcome.unreadable else []
    print(f"{', '.join(parts)} in {seconds:.1f} s\n{lake}")
    for failure in [*outcome.quarantined, *outcome.unreadable][:_SHOWN]:
        print(f"livebode: {_url(failure)}: {failure.sentence}", file=sys.stderr)
    if len(outcome.quarantined) > _SHOWN:
        print(f"livebode: all of them: livebode archive list {archive} --quarantined", file=sys.stderr)
    if outcome.stopped:
        left = f"{outcome.remaining:,} recordings remain; " if outcome.remaining else ""
        print(f"livebode: stopped; {left}the same command continues", file=sys.stderr)


def _url(failure: TrackingFailure) -> str:
    return str(failure.place.url)


def _plain(failure: TrackingFailure) -> dict[str, str]:
    return {"url": _url(failure), "code": failure.code, "sentence": failure.sentence}
