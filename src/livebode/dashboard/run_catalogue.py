"""All runs of a directory: their rows and trends, each computed again only if the run has changed."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import field
from pathlib import Path
from typing import Any, Generic, TypeVar

from livebode.analysis import alarms_of, fitted_rows, trend_points
from livebode.core import LivebodeError, RunClock, ServerError
from livebode.dashboard.run_entry import RunEntry, entry
from livebode.dataclass import dataclass
from livebode.language import Message, for_page
from livebode.records import RunRecord, is_run

SCAN_EVERY_S = 1.0
RUNS_MAX = 10_000
_TREND_S = 0.5  # of work for one request: the page asks again for the rest
_RECORDING_S = 30.0  # the trend of a run that is being recorded is not read more often
_WATCHED = ("run.json", "notes.json", "events.jsonl", "open")
T = TypeVar("T")


def runs_in(directory: Path) -> list[str]:
    """Names of the runs in a directory, sorted: no links, and no hidden names."""
    try:
        with os.scandir(directory) as entries:
            names = [
                item.name for item in entries if not item.name.startswith(".") and item.is_dir(follow_symlinks=False)
            ]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise ServerError(
            "run-unknown",
            f"{str(directory)!r} cannot be listed: {error.strerror}",
            "check its permissions",
            path=str(directory),
        ) from None
    return sorted(name for name in names if is_run(directory / name))[:RUNS_MAX]


@dataclass
class _CacheEntry(Generic[T]):
    """Values by name, with the number of the change that brought them."""

    values: dict[str, tuple[Any, int, T]] = field(default_factory=dict)
    version: int = 0

    def known(self, name: str, mark: Any) -> bool:
        return name in self.values and self.values[name][0] == mark

    def put(self, name: str, mark: Any, value: T) -> None:
        self.version += 1
        self.values[name] = mark, self.version, value

    def retain(self, names: set[str]) -> None:
        for gone in self.values.keys() - names:
            del self.values[gone]
            self.version += 1

    def since(self, version: int) -> dict[str, T]:
        return {name: value for name, (_, changed, value) in self.values.items() if changed > version}


class RunCatalogue:
    """The runs of a directory, used by one thread at a time.

    Parameters
    ----------
    directory
        It contains run directories.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._rows: _CacheEntry[RunEntry] = _CacheEntry()
        self._trends: _CacheEntry[dict[str, Any]] = _CacheEntry()
        self._scanned_s = float("-inf")
        self._lock = threading.Lock()  # lists and trends are read in other threads than the server's

    def path(self, name: str) -> Path:
        """The directory of a listed run; ServerError if there is none of this name."""
        if name not in runs_in(self.directory):  # a name from outside never becomes a path by itself
            raise ServerError(
                "run-unknown", f"there is no run {name[:80]!r}", Message("reload the page"), run=name[:80]
            )
        return self.directory / name

    def rows(self, since: int) -> dict[str, Any]:
        """Rows that changed after a version, and all names; `names` is None if nothing changed."""
        with self._lock:
            self._scan()
            if since == self._rows.version:
                return {"version": since, "names": None, "runs": []}
            changed = self._rows.since(since)
            return {
                "version": self._rows.version,
                "names": sorted(self._rows.values),
                "runs": [row.plain() for row in changed.values()],
            }

    def forget(self) -> None:
        """Look at the directory at the next request, however soon."""
        self._scanned_s = float("-inf")

    def trends(self, since: int) -> dict[str, Any]:
        """Trends that changed after a version, and how many runs are still to be read."""
        with self._lock:
            self._scan()
            self._trends.retain(set(self._rows.values))
            until, waiting = time.monotonic() + _TREND_S, 0
            for name, (files, _, row) in self._rows.values.items():
                mark = files, int(until / _RECORDING_S) if row.state == "recording" else 0
                if row.state == "broken" or self._trends.known(name, mark):
                    continue
                if time.monotonic() < until:
                    self._trends.put(name, mark, trend(self.directory / name))
                else:
                    waiting += 1
            return {"version": self._trends.version, "waiting": waiting, "runs": self._trends.since(since)}

    def _scan(self) -> None:
        now_s = time.monotonic()
        if now_s - self._scanned_s < SCAN_EVERY_S:
            return
        names = runs_in(self.directory)
        for name in names:
            mark = _mark(self.directory / name)
            # A run that grew may have stopped since: nothing of it changes then.
            if not self._rows.known(name, mark) or self._rows.values[name][2].state == "recording":
                row = entry(self.directory / name)
                if not self._rows.known(name, mark) or row != self._rows.values[name][2]:
                    self._rows.put(name, mark, row)
        self._rows.retain(set(names))
        self._scanned_s = time.monotonic()


def trend(run: Path) -> dict[str, Any]:
    """The points and alarms of a run, with their time of day; empty if it cannot be read."""

    def read(record: RunRecord) -> dict[str, Any]:
        clock, baseline = record.clock, record.summary.get("monitoring", {}).get("baseline")
        points = trend_points(record)
        return {
            "points": [
                [p.model, p.name, p.unit, p.value, p.bound_95, p.low, p.high, p.time_s, clock.unix_s(p.time_s), p.fits]
                for p in points
            ],
            "alarms": [[e.time_s, clock.unix_s(e.time_s), e.kind, for_page(e.words)] for e in alarms_of(record)],
            "baseline": None if baseline is None else str(baseline)[:200],
        }

    return _read(run, read, {"points": [], "alarms": [], "baseline": None})


def details(run: Path) -> list[list[Any]]:
    """For each quantity of a run: model, name, times of day, times of the run, values and 95 % bounds of some fits."""

    def read(record: RunRecord) -> list[list[Any]]:
        clock = record.clock
        return [
            [q.model, q.name, [_unix(clock, t) for t in time_s], time_s.tolist(), value.tolist(), bound.tolist()]
            for q in fitted_rows(record).quantities
            for time_s, value, bound in [q.shown()]
        ]

    return _read(run, read, [])


def _unix(clock: RunClock, time_s: float) -> float | None:
    return clock.unix_s(float(time_s))


def _read(run: Path, job: Callable[[RunRecord], T], otherwise: T) -> T:
    try:
        return job(RunRecord.open(run, lambda _: None, output_only=True))
    except (LivebodeError, OSError, KeyError, TypeError, ValueError, AttributeError):
        return otherwise  # the list says what is wrong with it


def _mark(run: Path) -> tuple[tuple[int, int, int], ...]:
    """What changes when the run changes."""
    marks = []
    for name in _WATCHED:
        try:
            known = os.lstat(run / name)
        except OSError:
            continue
        marks.append((known.st_ino, known.st_mtime_ns, known.st_size))
    return tuple(marks)
