"""Processes that record a live source, and are killed with signal 9 at random moments; what their record then holds.

Each sender numbers its samples, and sends the number as the channel n: what is lost, doubled or wrong in time shows.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Iterator
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from livebode.configuration import Axis
from livebode.records import RunRecord, each_event
from livebode.runtime import Destination, RunControl, run
from tests.support.forked import server
from tests.support.live_feeds import Feed
from tests.support.peers.peer import PATIENCE_S, until

REST: dict[str, Any] = {
    "signals": {"excitation": "w", "input": "u", "output": "y", "schedule": "n"},
    "lines": {"frequencies": "50,100,200", "window": 100},
    "tracking": {"hop": 20},
    "record": {"samples": True, "segment_s": 2},
}
START_S = 0.5
"""After its first commit a process has caught up with what came while it started."""
LIFE_S = 1.0
"""Longest life of a process from there on."""


def _work(configuration: dict[str, Any], directory: Path, outlet: Connection, fifo: Path | None) -> None:
    if fifo is not None:
        sys.stdin = os.fdopen(os.open(fifo, os.O_RDONLY))
    axis, control = Axis.model_validate(configuration), RunControl()
    signal.signal(signal.SIGTERM, lambda *_: control.end())
    outlet.send("begun")
    run(axis, Destination(directory, lambda *_: None), control)


def start(feed: Feed, directory: Path) -> ForkServerProcess:
    """A process that records this feed, once it has imported all."""
    context = server()
    results, outlet = context.Pipe(duplex=False)
    process = context.Process(
        target=_work, args=(REST | feed.rest | {"source": feed.source}, directory, outlet, feed.fifo)
    )
    process.start()
    outlet.close()
    assert results.poll(PATIENCE_S)
    results.recv()
    return process


def kill(process: ForkServerProcess) -> None:
    process.kill()
    process.join()


def stop(process: ForkServerProcess) -> None:
    """End it as Ctrl-C does."""
    process.terminate()
    process.join()
    assert process.exitcode == 0


def recorded(directory: Path, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the samples in the record, and the numbers that the sender gave them."""
    if not (directory / "run.json").exists():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    tables = list(map(pa.table, RunRecord.open(directory).tables("samples")))
    if not tables:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    return tuple(
        np.rint(np.concatenate([table[name].to_numpy() for table in tables])).astype(np.int64)
        for name in ("sample", channel)
    )  # type: ignore[return-value]


def kill_often(feed: Feed, directory: Path, kills: int, rng: np.random.Generator) -> Iterator[int]:
    """Kill so many processes that record this feed; the samples that each kill cost. Then let one record a second more.

    Every third is killed at any moment of its start, when it records nothing that is sent: that costs nothing of a
    record. What a source keeps for the next process, and what is sent while none records, is not the kill's either.
    """
    for number in range(kills):
        before = _written(directory)
        process = start(feed, directory)
        starting = number % 3 == 2
        if not starting:
            until(partial(_has_grown, directory, before), "the first commit of the process")
            time.sleep(START_S)
        time.sleep(rng.uniform(0, LIFE_S))
        sent = feed.sent
        kill(process)
        if not (starting or feed.keeps or feed.number == "sample"):
            yield max(0, sent - int(recorded(directory, feed.number)[1][-1]) - 1)
    held = recorded(directory, feed.number)[1].size
    process = start(feed, directory)
    until(lambda: recorded(directory, feed.number)[1].size >= held + feed.rate_hz, "a second more in the record")
    kill(process)


def _has_grown(directory: Path, before: dict[str, int]) -> bool:
    return _written(directory) != before


def _written(directory: Path) -> dict[str, int]:
    """The journals and their lengths, which every commit changes."""
    found = {}
    for path in (directory / "open").glob("*.journal"):
        with contextlib.suppress(FileNotFoundError):  # it was closed meanwhile
            found[path.name] = path.stat().st_size
    return found


def check_exact(directory: Path, channel: str, *, whole: bool, exact: bool = True) -> int:
    """That no sample is twice in the record, that each is at its time, and that each loss is named; the longest loss.

    `whole` asks for every sample from the first one on. Where the pause of livebode is not `exact`, each is a restart.
    """
    sample, number = recorded(directory, channel)
    assert np.all(np.diff(number) > 0), "a sample is in the record twice"
    events = [one for event in RunRecord.open(directory).events() for one in each_event(event)]
    if not exact:
        begins = {event.sample for event in events if event.kind == "restart"}
        moved = np.flatnonzero(np.diff(sample - number)) + 1
        assert set(sample[moved].tolist()) <= begins, "a sample is at a wrong time"
        return int(np.max(np.diff(number), initial=1)) - 1
    assert np.all(sample - number == sample[0] - number[0]), "a sample is at a wrong time"
    holes = np.flatnonzero(np.diff(sample) != 1)
    truth = {int(sample[at + 1]): int(sample[at + 1] - sample[at] - 1) for at in holes}
    named = {event.sample: event.details["missing_samples"] for event in events if event.kind == "loss"}
    found = {at: missing for at, missing in named.items() if at <= sample[-1]}
    assert found == truth, sorted(found.items() ^ truth.items())
    assert not whole or not truth
    return max(truth.values(), default=0)
