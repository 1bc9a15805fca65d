"""`python -m bench.live_blocks`: what a Block of a live axis costs, with everything around it.

One axis, as `livebode run` has it: datagrams of a drive, 21 lines, 20 responses a second, recorded. The next datagrams
come when the results of the ones before were published, so that each Block has as many of them as in the first column,
whatever else the computer does. Processor time of the process: reception, tracking, commits and the record's threads.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from bench.growth_live import sources_from
from bench.hall import Frames, Hall, axis
from bench.job import RATE_HZ
from livebode.runtime import Destination, Document, RunControl, TrackerResults, run
from livebode.sources.live import Address, AnyBatch, SourceSettings
from livebode.sources.live.udp import UdpSource

SECONDS, ROUNDS = 60.0, 3


@dataclass(frozen=True)
class Load:
    """Datagrams of one kind, so many in each Block."""

    spectra: bool
    together: int

    @property
    def block_s(self) -> float:
        return self.together * Hall(1, self.spectra).step / RATE_HZ


LOADS = Load(False, 2), Load(False, 4), Load(False, 10), Load(True, 1), Load(True, 5)


class Drive(UdpSource):
    """A drive whose datagrams come as soon as the ones before were tracked, by its clock at the speed of a machine."""

    def __init__(self, settings: SourceSettings, blocks: list[list[bytes]], tracked: threading.Semaphore) -> None:
        super().__init__(settings, Address("udp", host="127.0.0.1", port=1))
        self._blocks, self._tracked, self._begun_s = blocks, tracked, time.monotonic()

    def _deliver(self, batch: AnyBatch) -> None:
        super()._deliver(replace(batch, arrived_s=self._begun_s + batch.stop / batch.rate_hz))

    def _receive(self) -> bool:
        self._established()
        for block in self._blocks:
            self._tracked.acquire()
            with self._inbox._changed:  # the axis takes all of them together
                for datagram in block:
                    self._take_datagram(datagram, "127.0.0.1")
        return True


class Meter:
    """A subscriber that lets the drive go on, and takes the processor time from a third of the Blocks on."""

    def __init__(self, blocks: int, tracked: threading.Semaphore) -> None:
        self._marks, self._tracked = (blocks // 3, blocks - 1), tracked
        self._blocks = 0
        self._process_s: list[float] = []

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults):
            self._blocks += 1
            if self._blocks in self._marks:
                self._process_s.append(time.process_time())
            self._tracked.release()

    @property
    def block_ms(self) -> float:
        before, after = self._process_s
        return 1e3 * (after - before) / (self._marks[1] - self._marks[0])


def measure(load: Load, seconds: float) -> float:
    """Milliseconds of processor time for each Block."""
    frames, count = Frames(Hall(1, load.spectra)), round(seconds / load.block_s)
    blocks = [
        list(chain.from_iterable(frames.of(turn) for turn in range(first, first + load.together)))
        for first in range(0, count * load.together, load.together)
    ]
    tracked = threading.Semaphore(1)
    meter = Meter(count, tracked)
    with tempfile.TemporaryDirectory() as folder, sources_from(lambda given: Drive(given, blocks, tracked)):
        to = Destination(Path(folder) / "run", lambda *_: None, subscribers=(meter,))
        run(axis(Hall(1, load.spectra), 1), to, RunControl())
    return meter.block_ms


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.live_blocks", description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of the machine's time")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of which the least is printed")
    options = parser.parse_args()
    print("| a Block of | ms of processor time | ms/s an axis |\n|---|---|---|")
    for load in LOADS:
        block_ms = min(measure(load, options.seconds) for _ in range(options.rounds))
        name = f"{load.together} {'spectra' if load.spectra else 'batches of samples'}, {1e3 * load.block_s:.0f} ms"
        print(f"| {name} | {block_ms:.3f} | {block_ms / load.block_s:.2f} |", flush=True)


if __name__ == "__main__":
    main()
