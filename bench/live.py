"""`python -m bench.live`: latency of a response from the arrival of its samples, and processor time of the axes.

Senders in another process send over UDP as drives would: 4 kHz, batches of 25 ms, numbered; the session in this process
tracks 21 lines in a window of 400 at 20 responses per second and records them, as `livebode run` does. Latency is from
the arrival of a datagram (`LiveBlock.arrived_s`) until all its results were published (`Tracked`), for Blocks
that give a response. The first second is excluded, because a UDP source first collects eight batches to put them in
order. What examines seconds of samples (roles, transient, phase slips) follows after that, on the same thread: it
delays the next Block, whose latency includes it.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import socket
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event as Flag
from pathlib import Path

import numpy as np

from bench.browser import chromium
from bench.job import LINES, RATE_HZ, WINDOW, signals
from livebode.configuration import Axis
from livebode.core import Block, Channel, Responses
from livebode.dashboard import Dashboard, ServerSettings
from livebode.runtime import Destination, Document, Session, Subscriber, TrackerResults
from livebode.sources.live import Batch, LiveBlock, encode_layout, encode_samples

CHANNELS = (Channel("w", "N m"), Channel("u", "N m"), Channel("y", "rad/s"))
BATCH, HOP = 100, 200
SECONDS = 75.0
WAKE_S = 0.01
TARGET_S, TARGET_ALONE_S = 0.020, 0.003
"""Of the p99 of sixteen axes, and of one."""
CORES = 2


class Clock:
    """Measures the time of each Block that gives a response, including the subscribers' work."""

    def __init__(self) -> None:
        self.latency_s: list[float] = []
        self._new = 0

    def __call__(self, document: Document) -> None:
        if isinstance(document, Responses):
            self._new += len(document)
        elif isinstance(document, TrackerResults):
            self._measure(document.block)

    def _measure(self, block: Block) -> None:
        if self._new and isinstance(block, LiveBlock) and block.start >= RATE_HZ:
            self.latency_s.append(time.monotonic() - block.arrived_s)
        self._new = 0


@dataclass(frozen=True)
class Scenario:
    name: str
    axes: int = 1
    dashboard: bool = False
    record: dict[str, object] = field(default_factory=dict)


SCENARIOS = (
    Scenario("one axis"),
    Scenario("one axis, the dashboard open", dashboard=True),
    Scenario("one axis, samples recorded, a segment closed every 2 s", record={"samples": True, "segment_s": 2.0}),
    Scenario("16 axes", axes=16),
    Scenario("16 axes, the dashboard open", axes=16, dashboard=True),
    Scenario(
        "16 axes, samples recorded, a segment closed every 10 s", axes=16, record={"samples": True, "segment_s": 10.0}
    ),
)


def axis(port: int, scenario: Scenario) -> Axis:
    data: dict[str, object] = {
        "source": {"url": f"udp://127.0.0.1:{port}"},
        "signals": {"excitation": "w", "input": "u", "output": "y"},
        "lines": {"frequencies": ",".join(f"k={k}" for k in LINES.bins), "window": WINDOW},
        "tracking": {"hop": HOP},
        "record": scenario.record,
    }
    return Axis.of(data, scenario.name)


def send(ports: list[int], end: Flag) -> None:
    """Send the data of a cabinet of drives; the axes are spread over 25 ms, because they are not synchronous."""
    data = signals()[:, : 60 * RATE_HZ]
    links = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in ports]
    for link, port in zip(links, ports):
        link.connect(("127.0.0.1", port))
    began, step_s, count = time.monotonic(), BATCH / RATE_HZ / len(ports), 0
    while not end.is_set():
        turn, which = divmod(count, len(ports))
        time.sleep(max(0.0, began + count * step_s - time.monotonic()))
        first = turn * BATCH
        at = first % data.shape[1]
        frames = [encode_samples(Batch(first, data[:, at : at + BATCH], CHANNELS, RATE_HZ, epoch=7), sequence=turn)]
        if first % RATE_HZ == 0:
            frames.insert(0, encode_layout(CHANNELS, RATE_HZ, epoch=7))
        for frame in frames:
            try:
                links[which].send(frame)
            except ConnectionRefusedError:  # the receiver does not listen yet
                continue
        count += 1


def wake(end: Flag, results: Connection) -> None:
    """Wake-up delay of an idle process: the computer's own contribution to every latency."""
    late_s, due = [], time.monotonic()
    while not end.is_set():
        due += WAKE_S
        time.sleep(max(0.0, due - time.monotonic()))
        late_s.append(time.monotonic() - due)
        due = max(due, time.monotonic() - WAKE_S)
    results.send([float(np.quantile(late_s, 0.99)), max(late_s)])


def look_on(url: str, end: Flag) -> None:
    """The browser of a person, on the first axis; it yields to the run, since it is mostly on another computer."""
    os.nice(19)
    with chromium() as browser:
        shown = browser.new_page(viewport={"width": 1440, "height": 900})
        shown.goto(url)
        while not end.is_set():
            shown.wait_for_timeout(200)


def measure(scenario: Scenario, seconds: float) -> dict[str, float]:
    """Latency, losses and processor time of a scenario."""
    names = [f"x{i}" for i in range(scenario.axes)]
    if not scenario.dashboard:
        return _measured(scenario, seconds, dict.fromkeys(names, ()), None)
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hubs = {name: (dashboard.hub(name),) for name in names}
    with dashboard:
        return _measured(scenario, seconds, hubs, dashboard.url)


def _measured(
    scenario: Scenario, seconds: float, hubs: dict[str, tuple[Subscriber, ...]], url: str | None
) -> dict[str, float]:
    clocks = {name: Clock() for name in hubs}  # after the dashboard, so that its work is in the latency
    context = multiprocessing.get_context("spawn")
    ports, end = free_ports(scenario.axes), context.Event()
    results, outlet = context.Pipe(duplex=False)
    beside = [context.Process(target=send, args=(ports, end)), context.Process(target=wake, args=(end, outlet))]
    if url is not None:
        beside.append(context.Process(target=look_on, args=(url, end)))
    with tempfile.TemporaryDirectory() as folder:
        session = Session(
            {name: axis(port, scenario) for name, port in zip(clocks, ports)},
            lambda name, _: Destination(Path(folder) / name, lambda *_: None, subscribers=(*hubs[name], clocks[name])),
            report=lambda name, event: print(f"  {name}: {event.message}"),
            leave=lambda *_: None,
        )
        for process in beside:
            process.start()
        marks: list[tuple[float, float]] = []

        def look() -> None:
            tracking = all(thread.status.state == "tracking" for thread in session.all)
            now = time.monotonic()
            if tracking and (not marks or now - marks[0][0] < seconds):
                marks[1:] = [(now, time.process_time())]
                if len(marks) == 1:
                    marks.append(marks[0])
            elif marks:
                session.end()

        try:
            session.run(look)
        finally:
            end.set()
            late_s = results.recv()
            for process in beside:
                process.join()
        for thread in session.all:
            thread.result()
    latency = np.concatenate([clock.latency_s for clock in clocks.values()])
    health = [thread.result().summary["source"] for thread in session.all]
    (began, cpu), (ended, cpu_then) = marks
    return {
        "responses": float(sum(thread.status.responses for thread in session.all)),
        "p50, ms": 1e3 * float(np.median(latency)),
        "p99, ms": 1e3 * float(np.quantile(latency, 0.99)),
        "longest, ms": 1e3 * float(latency.max()),
        "samples lost": float(sum(one["lost"] for one in health)),
        "overflows": float(sum(one["counts"]["overflow"] for one in health)),
        "cores used": (cpu_then - cpu) / (ended - began),
        "seconds": ended - began,
        "wake-up delay of an idle process, p99, ms": 1e3 * late_s[0],
        "wake-up delay, longest, ms": 1e3 * late_s[1],
    }


def report(scenario: Scenario, found: dict[str, float]) -> None:
    target_s = TARGET_ALONE_S if scenario.axes == 1 else TARGET_S
    targets = {
        f"p99 ≤ {1e3 * target_s:g} ms": found["p99, ms"] <= 1e3 * target_s,
        f"nothing lost, at most {CORES} cores": not found["samples lost"] and found["cores used"] <= CORES,
    }
    show(scenario.name, found, targets)


def show(name: str, found: dict[str, float], targets: dict[str, bool]) -> None:
    """Print what was found, and which targets are met."""
    print(name)
    for label, value in found.items():
        print(f"  {label:42}{value:10.4g}")
    for target, reached in targets.items():
        print(f"  target {target}: {'met' if reached else 'missed'}", flush=True)


def free_ports(count: int, kind: int = socket.SOCK_DGRAM) -> list[int]:
    """Ports that are free, below those that a system gives to senders: one of these may have it before its receiver."""
    ports: list[int] = []
    candidates = random.sample(range(20_000, 32_000), 4_000)
    while len(ports) < count:
        with socket.socket(socket.AF_INET, kind) as link, suppress(OSError):  # it is in use
            link.bind(("127.0.0.1", candidates.pop()))
            ports.append(int(link.getsockname()[1]))
    return ports


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.live", description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="duration of each scenario")
    parser.add_argument("--only", default="", help="only scenarios whose name begins with this")
    options = parser.parse_args()
    for scenario in SCENARIOS:
        if scenario.name.startswith(options.only):
            report(scenario, measure(scenario, options.seconds))


if __name__ == "__main__":
    main()
