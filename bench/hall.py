"""`python -m bench.hall`: a hall of machines on one computer: 64 axes that send samples, and 256 that send spectra.

Drives in another process send over UDP: samples at 4 kHz in batches of 25 ms, or 20 spectra per second. Sessions, as
`livebode run` has them, track 21 lines at 20 responses per second and record them, in one process or in several that
share the axes. Latency is from the sending of the samples that complete a response until its results were published,
so that waiting in the socket is included. What happens before the axes have tracked for some seconds is excluded.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import platform
import sys
import tempfile
import time
from collections.abc import Sequence
from ctypes import c_double
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import RawArray
from multiprocessing.synchronize import Event as Flag
from pathlib import Path
from socket import AF_INET, SOCK_DGRAM, socket
from typing import Any

import numpy as np

from bench.job import LINES, RATE_HZ, WINDOW, signals
from bench.live import BATCH, CHANNELS, CORES, HOP, free_ports, show, wake
from livebode.cli.start import OBJECTS_NEW
from livebode.configuration import Axis
from livebode.core import Block, Responses, SpectraLayout
from livebode.runtime import Destination, Document, Session, TrackerResults
from livebode.sources.live import Batch, LiveBlock, encode_layout, encode_samples, encode_spectra, encode_spectra_layout
from livebode.sources.live.kernel_drive import KernelDrive

SECONDS, SETTLE_S = 60.0, 10.0
TARGET_S = 0.050
GROUPS = 16
"""The axes send in so many groups, evenly within a period: drives are not synchronous."""
TURNS = 1 << 12
"""Turns whose times of sending are remembered."""
EPOCH = 7


@dataclass(frozen=True)
class Hall:
    """Axes of one kind, tracked by so many processes."""

    axes: int
    spectra: bool = False
    processes: int = 1

    @property
    def name(self) -> str:
        what = "spectra, 20/s" if self.spectra else "samples, 4 kHz, 25 ms"
        return f"{self.axes} axes, {what}, {self.processes} process{'es' * (self.processes > 1)}"

    @property
    def step(self) -> int:
        """Samples of a datagram."""
        return HOP if self.spectra else BATCH


HALLS = (
    Hall(64),
    Hall(64, processes=2),
    Hall(256, spectra=True),
    Hall(256, spectra=True, processes=2),
)


class Frames:
    """What every axis sends in a turn, encoded once: the axes differ only in when and where to they send."""

    def __init__(self, hall: Hall) -> None:
        self._hall, self._data = hall, signals()[:, : 60 * RATE_HZ]
        self._layout = SpectraLayout(CHANNELS, (), WINDOW, HOP, tuple(LINES.bins))
        if hall.spectra:
            blocks = (self._block(first) for first in range(0, self._data.shape[1], HOP))
            self._spectra = [*KernelDrive(self._layout).spectra(blocks, EPOCH)][WINDOW // HOP :]  # of whole windows

    def _block(self, first: int) -> Block:
        return Block(self._data[:, first : first + HOP], CHANNELS, rate_hz=RATE_HZ, start=first)

    def of(self, turn: int) -> list[bytes]:
        """The layout once a second, and the samples or the spectrum of this turn."""
        first, hall = turn * self._hall.step, self._hall
        at = first % self._data.shape[1]
        layout: list[bytes] = []
        if hall.spectra:
            if first % RATE_HZ == 0:
                layout = [encode_spectra_layout(self._layout, RATE_HZ, epoch=EPOCH)]
            spectrum = self._spectra[turn % len(self._spectra)]
            return [*layout, encode_spectra(replace(spectrum, first_sample=first), sequence=turn)]
        if first % RATE_HZ == 0:
            layout = [encode_layout(CHANNELS, RATE_HZ, epoch=EPOCH)]
        batch = Batch(first, self._data[:, at : at + BATCH], CHANNELS, RATE_HZ, epoch=EPOCH)
        return [*layout, encode_samples(batch, sequence=turn)]


def send(hall: Hall, ports: list[int], sent_s: Any, end: Flag, results: Connection) -> None:
    """Send until the end, and report the share of a core that this needed."""
    frames, links = Frames(hall), [socket(AF_INET, SOCK_DGRAM) for _ in ports]
    for link, port in zip(links, ports):
        link.connect(("127.0.0.1", port))
    times = np.frombuffer(sent_s).reshape(TURNS, GROUPS)
    groups = [links[g::GROUPS] for g in range(GROUPS)]
    began, cpu, turn = time.monotonic(), time.process_time(), 0
    while not end.is_set():
        now = frames.of(turn)
        for g, group in enumerate(groups):
            due = began + (turn + g / GROUPS) * hall.step / RATE_HZ
            time.sleep(max(0.0, due - time.monotonic()))
            times[turn % TURNS, g] = time.monotonic()
            for link in group:
                for frame in now:
                    try:
                        link.send(frame)
                    except ConnectionRefusedError:  # the receiver does not listen yet
                        continue
        turn += 1
    results.send((time.process_time() - cpu) / (time.monotonic() - began))


class ResponseClock:
    """Measures each response of an axis from the sending of the samples that complete it."""

    def __init__(self, hall: Hall, axis: int, sent_s: Any) -> None:
        self._step, self._group = hall.step, axis % GROUPS
        self._sent_s = np.frombuffer(sent_s).reshape(TURNS, GROUPS)
        self._samples: list[int] = []
        self.found_s: list[tuple[float, float]] = []
        """When a response was published, and its latency."""

    def __call__(self, document: Document) -> None:
        if isinstance(document, Responses):
            self._samples += document.sample.tolist()
        elif isinstance(document, TrackerResults) and self._samples:
            now, block = time.monotonic(), document.block
            if isinstance(block, LiveBlock) and block.origin is not None:
                offset = block.origin.offset
                turns = [(sample + offset) // self._step % TURNS for sample in self._samples]
                self.found_s += [(now, now - float(self._sent_s[turn, self._group])) for turn in turns]
            self._samples.clear()


def axis(hall: Hall, port: int) -> Axis:
    data: dict[str, object] = {
        "source": {"url": f"udp://127.0.0.1:{port}"},
        "signals": {"excitation": "w", "input": "u", "output": "y"},
        "record": {},
    }
    if not hall.spectra:
        data["lines"] = {"frequencies": ",".join(f"k={k}" for k in LINES.bins), "window": WINDOW}
        data["tracking"] = {"hop": HOP}
    return Axis.of(data, hall.name)


def track(
    hall: Hall, members: Sequence[int], ports: list[int], sent_s: Any, seconds: float, results: Connection
) -> None:
    """A process with a share of the axes: a Session, and what it measured."""
    gc.set_threshold(OBJECTS_NEW)  # as in the command
    gc.freeze()
    names = {f"x{i}": i for i in members}
    clocks = {name: ResponseClock(hall, i, sent_s) for name, i in names.items()}
    marks: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        session = Session(
            {name: axis(hall, ports[i]) for name, i in names.items()},
            lambda name, _: Destination(Path(folder) / name, lambda *_: None, subscribers=(clocks[name],)),
            report=lambda name, event: print(f"  {name}: {event.message}"),
            leave=lambda *_: None,
        )
        since: list[float] = []

        def look() -> None:
            now = time.monotonic()
            if not since and all(thread.status.state == "tracking" for thread in session.all):
                since.append(now)
            passed_s = now - since[0] if since else 0.0
            if len(marks) < (passed_s > SETTLE_S) + (passed_s > SETTLE_S + seconds):
                marks.append((now, time.process_time()))
            if len(marks) == 2:
                session.end()

        session.run(look)
        health = [thread.result().summary["source"] for thread in session.all]
    (began, cpu), (ended, cpu_then) = marks
    latency_s = [late for clock in clocks.values() for at, late in clock.found_s if began <= at <= ended]
    lost = sum(one["lost"] + one["counts"]["overflow"] for one in health)
    results.send((latency_s, lost, (cpu_then - cpu) / (ended - began), ended - began))


def measure(hall: Hall, seconds: float) -> dict[str, float]:
    """Latency, losses and processor time."""
    context = multiprocessing.get_context("spawn")
    ports, end = free_ports(hall.axes), context.Event()
    sent_s = RawArray(c_double, TURNS * GROUPS)
    sender, idle = context.Pipe(duplex=False), context.Pipe(duplex=False)
    beside = [
        context.Process(target=send, args=(hall, ports, sent_s, end, sender[1])),
        context.Process(target=wake, args=(end, idle[1])),
    ]
    shares = [list(range(k, hall.axes, hall.processes)) for k in range(hall.processes)]
    pipes = [context.Pipe(duplex=False) for _ in shares]
    tracking = [
        context.Process(target=track, args=(hall, share, ports, sent_s, seconds, outlet))
        for share, (_, outlet) in zip(shares, pipes)
    ]
    for process in (*tracking, *beside):
        process.start()
    for _, outlet in pipes:
        outlet.close()  # so that the end of a process that failed is an EOFError here
    try:
        parts = [inlet.recv() for inlet, _ in pipes]
    finally:
        end.set()
        for process in (*tracking, *beside):
            process.join()
    latency_s = np.concatenate([part[0] for part in parts])
    due = hall.axes * RATE_HZ / HOP * float(np.mean([part[3] for part in parts]))
    cores = sum(part[2] for part in parts)
    late_s = idle[0].recv()
    return {
        "responses of those due": latency_s.size / due,
        "p50, ms": 1e3 * float(np.median(latency_s)),
        "p99, ms": 1e3 * float(np.quantile(latency_s, 0.99)),
        "longest, ms": 1e3 * float(latency_s.max()),
        "samples lost": float(sum(part[1] for part in parts)),
        "cores used": cores,
        "processor time of an axis, ms/s": 1e3 * cores / hall.axes,
        "cores used by the sender": sender[0].recv(),
        "wake-up delay of an idle process, p99, ms": 1e3 * late_s[0],
        "wake-up delay, longest, ms": 1e3 * late_s[1],
    }


def report(hall: Hall, found: dict[str, float]) -> None:
    targets = {
        "0 lost": not found["samples lost"],
        f"p99 ≤ {1e3 * TARGET_S:g} ms": found["p99, ms"] <= 1e3 * TARGET_S,
        f"at most {CORES} cores": found["cores used"] <= CORES,
    }
    show(hall.name, found, targets)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.hall", description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="duration of each measurement")
    parser.add_argument("--axes", type=int, help="only so many axes, in place of all the measurements")
    parser.add_argument("--spectra", action="store_true", help="with --axes: they send spectra")
    parser.add_argument("--processes", type=int, default=1, help="with --axes: so many processes share them")
    options = parser.parse_args()
    locked = getattr(sys, "_is_gil_enabled", lambda: True)()
    print(f"Python {platform.python_version()}, {'with' if locked else 'without'} the interpreter lock")
    halls = HALLS if options.axes is None else (Hall(options.axes, options.spectra, options.processes),)
    for hall in halls:
        report(hall, measure(hall, options.seconds))


if __name__ == "__main__":
    main()
