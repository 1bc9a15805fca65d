"""Recording on a disk that is full for a while; `python -m tests.support.starved DIRECTORY` on a small file system."""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Callable
from pathlib import Path

from livebode.core import Event
from tests.support.recorded import check_beginning, check_whole, machine, record_machine

SAMPLES, FROM, UNTIL = 8000, 2550, 6120


def record_starved(run: Path, starve: Callable[[], None], feed: Callable[[], None]) -> list[Event]:
    """Record while `starve` leaves no room and until `feed` makes some; what the record said of itself."""
    reported: list[Event] = []

    def each(start: int) -> None:
        if start == FROM:
            starve()
        if start == UNTIL:
            # What was committed before can be read all the while.
            check_beginning(run, SAMPLES, FROM - 1000)
            feed()

    outcome = record_machine(machine(SAMPLES, each), run, report=reported.append)
    assert outcome.summary["counts"]["samples"] == SAMPLES
    check_whole(run, SAMPLES)
    return reported


def on_a_limited_file(run: Path) -> list[Event]:
    """The process may not make files longer than they are now."""

    def limit(size: int) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    return record_starved(run, lambda: limit(4096), lambda: limit(resource.RLIM_INFINITY))


def on_a_full_disk(run: Path) -> list[Event]:
    """Another file takes all that is left."""
    other = run.with_name("other")

    def fill() -> None:
        for size in (1 << 16, 1 << 12, 1):
            with other.open("ab", buffering=0) as file:
                try:
                    while True:
                        file.write(bytes(size))
                except OSError:
                    continue

    return record_starved(run, fill, lambda: os.unlink(other))


if __name__ == "__main__":
    print(" ".join(event.kind for event in on_a_full_disk(Path(sys.argv[1]) / "run")))
