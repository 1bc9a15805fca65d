"""Live axes whose machines send as fast as livebode tracks: the load of `bench.growth`.

Each axis is that of `bench.monitoring_live` at standstill: 4 kHz, three signals in batches of 25 ms, 21 lines, 20
responses a second, each fitted, compared with a baseline, recorded in segments, and published to a dashboard. The
machine is a live source of this process whose clock waits for the tracker, so nothing is omitted and the clock runs as
fast as the computer permits.
"""

from __future__ import annotations

import json
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bench.monitoring_live import RATE_HZ, UNITS, at_hop, standing
from livebode.configuration import Axis, RecordSection
from livebode.core import Channel
from livebode.dashboard import Dashboard, Hub, ServerSettings
from livebode.runtime import Destination, Document, Session, TrackerResults, live
from livebode.sources.live import Address, Batch, LiveSource, SourceSettings

BATCH, HOP = 100, 200
MAILBOX_MAX, MAILBOXES_MAX = 40, 400
"""Responses and fits that wait for the dashboard: of one axis, or of all if that is more."""
CHANNELS = tuple(Channel(name, unit) for name, unit in UNITS.items())
Floats = NDArray[np.float64]
Times = Callable[[int], int]
"""Number of the first sample of a batch, of the number of the batch."""


def prepare(folder: Path) -> None:
    """Write baseline, configuration and samples of the machine."""
    axis, block = standing(folder)
    (folder / "axis.json").write_text(json.dumps(axis.model_dump(mode="json", by_alias=True, exclude_defaults=True)))
    np.save(folder / "samples.npy", block.data)


class Machine(LiveSource):
    """Sends so many batches, at the times of its clock, and then nothing until it is closed.

    Its clock also waits for the dashboard: as fast as the computer permits, its thread would get too small a share of
    the interpreter, and its mailbox would be as full as it never is at the speed of a machine.
    """

    format: ClassVar[str] = "machine"
    waits: ClassVar[bool] = True

    def __init__(
        self, settings: SourceSettings, samples: Floats, batches: int, times: Times, hub: Hub, waiting_max: int
    ) -> None:
        super().__init__(settings, Address("machine", path="machine"))
        self._samples, self._batches, self._times = samples, batches, times
        self._hub, self._waiting_max = hub, waiting_max

    def _receive(self) -> bool:
        self._established()
        for n in range(self._batches):
            if self._stop.is_set():
                break
            while len(self._hub._rows) > self._waiting_max and not self._stop.is_set():
                time.sleep(0.05)
            at = n * BATCH % self._samples.shape[1]
            self._deliver(Batch(self._times(n), self._samples[:, at : at + BATCH].copy(), CHANNELS, RATE_HZ, epoch=7))
        self._stop.wait()
        return False


class Marks:
    """A subscriber of all axes that notes age, processed samples, processor time and memory each `every` batches."""

    def __init__(self, every: int) -> None:
        self.batches = 0
        self.age_s: list[float] = []
        self.data_s: list[float] = []
        self.cpu_s: list[float] = []
        self.resident_mb: list[float] = []
        self._every, self._lock = every, threading.Lock()

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults):
            with self._lock:
                self.batches += 1
                if self.batches % self._every == 0:
                    self.age_s.append(document.block.stop / RATE_HZ)
                    self.data_s.append(self.batches * BATCH / RATE_HZ)
                    self.cpu_s.append(time.process_time())
                    self.resident_mb.append(resident_mb())


def run(
    folder: Path, axes: int, batches: int, marks: Marks, times: Times = BATCH.__mul__, segment_s: float = 300.0
) -> None:
    """Track so many axes with a dashboard until each machine has sent so many batches."""
    logging.disable(logging.WARNING)  # thousands of losses
    axis = json.loads((folder / "axis.json").read_text()) | {"source": {"url": "tcp://127.0.0.1:1"}}
    found = at_hop(Axis.of(axis, "growth"), HOP).model_copy(update={"record": RecordSection(segment_s=segment_s)})
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hubs = {f"x{i}": dashboard.hub(f"x{i}") for i in range(axes)}
    samples = np.load(folder / "samples.npy")  # one for all, so that it does not count as memory of an axis
    hub, waiting_max = iter(hubs.values()), max(MAILBOX_MAX, MAILBOXES_MAX // axes)
    with (
        TemporaryDirectory() as into,
        dashboard,
        sources_from(lambda given: Machine(given, samples, batches, times, next(hub), waiting_max)),
    ):
        session = Session(
            dict.fromkeys(hubs, found),
            lambda name, _: Destination(Path(into) / name, lambda *_: None, subscribers=(hubs[name], marks)),
            report=lambda name, event: print(f"  {name}: {event.message}"),
            leave=lambda *_: None,
        )

        def look() -> None:
            if marks.batches >= axes * batches:
                session.end()

        session.run(look)
    for thread in session.all:
        thread.result()


@contextmanager
def sources_from(source_of: Callable[[SourceSettings], LiveSource]) -> Iterator[None]:
    before, live.source_of = live.source_of, source_of  # type: ignore[assignment]
    try:
        yield
    finally:
        live.source_of = before


def resident_mb() -> float:
    """Memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
