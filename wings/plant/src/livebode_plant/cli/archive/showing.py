"""Progress and result of a run of an archive on the terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import typer

from livebode.cli import console

if TYPE_CHECKING:
    from livebode_plant.archive.coordinator import ArchiveOutcome, Coordinator, Progress
    from livebode_plant.archive.results import TrackingFailure

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
        bad = {name: [_plain(one) for one in getattr(outcome, name)] for name in ("quarantined", "unreadable")}
        numbers = ("recordings", "known", "tracked", "stopped", "remaining")
        print(to_json({"lake": lake} | {name: getattr(outcome, name) for name in numbers} | bad))
        return
    parts = [f"{outcome.recordings:,} recordings", f"{outcome.known:,} known", f"{outcome.tracked:,} tracked"]
    parts += [f"{len(outcome.quarantined):,} to quarantine"] if outcome.quarantined else []
    parts += [f"{len(outcome.unreadable):,} not readable"] if outcome.unreadable else []
    print(f"{', '.join(parts)} in {seconds:.1f} s\n{lake}")
    for one in [*outcome.quarantined, *outcome.unreadable][:_SHOWN]:
        print(f"livebode: {_url(one)}: {one.sentence}", file=sys.stderr)
    if len(outcome.quarantined) > _SHOWN:
        print(f"livebode: all of them: livebode archive list {archive} --quarantined", file=sys.stderr)
    if outcome.stopped:
        left = f"{outcome.remaining:,} recordings remain; " if outcome.remaining else ""
        print(f"livebode: stopped; {left}the same command continues", file=sys.stderr)


def _url(one: TrackingFailure) -> str:
    return str(one.place.url)


def _plain(one: TrackingFailure) -> dict[str, str]:
    return {"url": _url(one), "code": one.code, "sentence": one.sentence}
