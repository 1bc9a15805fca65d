"""`python -m bench.live_blocks`: what a Block of a live axis costs, with everything around it.

Axes as `livebode run` has them: datagrams of drives in another process, 21 lines, 20 responses a second, recorded. The
next datagrams come when the results of the ones before were published, so that each Block has as many of them as in the
first column, and those of several axes come together, whatever else the computer does. Processor time of the process:
reception, tracking, commits and the record's threads.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, product
from multiprocessing.connection import Connection
from pathlib import Path
from socket import AF_INET, SOCK_DGRAM, socket
from threading import Lock, Thread

from bench.growth_live import sources_from
from bench.hall import Frames, Hall, axis
from bench.job import RATE_HZ
from bench.live import free_ports
from livebode.cli.start import OBJECTS_NEW
from livebode.runtime import Destination, Document, RunControl, TrackerResults, run
from livebode.sources.live import AnyBatch, SourceSettings, parse_address
from livebode.sources.live.framing import read_header
from livebode.sources.live.udp import UdpSource

SECONDS, ROUNDS = 60.0, 3
GO, END = b"go", b"end"


@dataclass(frozen=True)
class Load:
    """Datagrams of one kind, so many in each Block of each axis."""

    spectra: bool
    together: int
    axes: int = 1

    @property
    def hall(self) -> Hall:
        return Hall(self.axes, self.spectra)

    @property
    def block_s(self) -> float:
        return self.together * self.hall.step / RATE_HZ

    @property
    def name(self) -> str:
        name = f"{self.together} {'spectra' if self.spectra else 'batches of samples'}, {1e3 * self.block_s:.0f} ms"
        return name if self.axes == 1 else f"{name}, of {self.axes} axes together"


LOADS = Load(False, 2), Load(False, 4), Load(False, 10), Load(True, 1), Load(True, 5), Load(True, 1, 32)


def send(load: Load, count: int, ports: list[int], ready: Connection) -> None:
    """Drives in a process of their own: send a Block to each port for each `GO` that it receives."""
    frames = Frames(load.hall)
    with socket(AF_INET, SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        ready.send(link.getsockname())
        for first in range(0, count * load.together, load.together):
            block = list(chain.from_iterable(map(frames.of, range(first, first + load.together))))
            if link.recv(len(END)) == END:
                return
            for datagram, port in product(block, ports):
                link.sendto(datagram, ("127.0.0.1", port))


class Drive(UdpSource):
    """Receives the datagrams of a drive that sends when it may, by its clock at the speed of a machine."""

    def __init__(self, settings: SourceSettings, together: int, go: Callable[[], object]) -> None:
        super().__init__(settings, parse_address(str(settings.url)))
        self._together, self._go, self._begun_s = together, go, time.monotonic()
        self._block: list[bytes] = []

    def _established(self) -> None:
        super()._established()
        self._go()

    def _take_datagram(self, datagram: bytes, host: str) -> None:
        self._block.append(datagram)
        samples = sum(read_header(one).samples > 0 for one in self._block)
        if samples == self._together:
            block, self._block = self._block, []
            with self._inbox._changed:  # the axis takes all of them together
                for one in block:
                    super()._take_datagram(one, host)

    def _deliver(self, batch: AnyBatch, *, waits: bool | None = None) -> None:
        object.__setattr__(batch, "arrived_s", self._begun_s + batch.stop / batch.rate_hz)  # at no cost
        super()._deliver(batch, waits=waits)


class Meter:
    """Lets the drives go on when all axes have tracked, and takes the processor time from a third of the Blocks on."""

    def __init__(self, load: Load, blocks: int, go: Callable[[], object], end: Callable[[], None]) -> None:
        self._marks, self._go, self._end, self._load = (blocks // 3, blocks - 1), go, end, load
        self._opened = self._tracked = 0
        self._lock = Lock()
        self._process_s: list[float] = []

    def opened(self) -> None:
        """A source receives."""
        with self._lock:
            self._opened += 1
            if self._opened == self._load.axes:
                self._go()

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults):
            self._tracked += 1
            blocks, others = divmod(self._tracked, self._load.axes)
            if others:
                return
            if blocks in self._marks:
                self._process_s.append(time.process_time())
            (self._go if blocks < self._marks[1] else self._end)()

    @property
    def block_ms(self) -> float:
        before, after = self._process_s
        return 1e3 * (after - before) / (self._marks[1] - self._marks[0]) / self._load.axes


def measure(load: Load, seconds: float) -> float:
    """Milliseconds of processor time for each Block of an axis."""
    count, ports = round(seconds / load.block_s), free_ports(load.axes)
    context = multiprocessing.get_context("spawn")
    inlet, outlet = context.Pipe(duplex=False)
    drives = context.Process(target=send, args=(load, count, ports, outlet))
    drives.start()
    controls = [RunControl() for _ in ports]
    with socket(AF_INET, SOCK_DGRAM) as link, tempfile.TemporaryDirectory() as folder:
        link.connect(inlet.recv())

        def end() -> None:
            for control in controls:
                control.end()

        meter = Meter(load, count, lambda: link.send(GO), end)

        def follow(port: int, control: RunControl) -> None:
            to = Destination(Path(folder) / str(port), lambda *_: None, subscribers=(meter,))
            run(axis(load.hall, port), to, control)

        threads = [Thread(target=follow, args=one) for one in zip(ports, controls)]
        with sources_from(lambda given: Drive(given, load.together, meter.opened)):
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        link.send(END)
        drives.join()
    return meter.block_ms


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.live_blocks", description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of the machine's time")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of which the least is printed")
    options = parser.parse_args()
    gc.set_threshold(OBJECTS_NEW)  # as in the command
    gc.freeze()
    print("| a Block of | ms of processor time | ms/s an axis |\n|---|---|---|")
    for load in LOADS:
        block_ms = min(measure(load, options.seconds) for _ in range(options.rounds))
        print(f"| {load.name} | {block_ms:.3f} | {block_ms / load.block_s:.2f} |", flush=True)


if __name__ == "__main__":
    main()
