"""`livebode fleet run --demo`: a log, workers and simulated axes; a worker is killed, and nothing is lost."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Self

import numpy as np

from livebode import excitation
from livebode.configuration import Axis
from livebode.core import Lines, counted
from livebode.dataclass import dataclass
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis
from livebode.sources.live import Batch
from livebode_plant.fleet.coordinator import FleetCoordinator
from livebode_plant.fleet.edge import Edge, send_edges
from livebode_plant.fleet.edge_buffer import FILE_BYTES, EdgeBuffer
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.log import with_log
from livebode_plant.fleet.replay import CheckResult, check_results
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status, silences

RATE_HZ, WINDOW = 4000.0, 400
BLOCK_S = 0.1
_SIMULATED_S = 2.0
_FREQUENCIES = "20:140:20"
_CHANNELS = ("w", "u", "velocity")
_AXIS = """[machine]
site = "demo"
machine = "machine {machine}"
axis = "{axis}"

[source]
url = "udp://127.0.0.1:5000"

[signals]
output = "velocity"
input = "u"
excitation = "w"

[lines]
frequencies = "{frequencies}"
window = {window}
"""


def write_simulated_fleet(folder: Path, url: str, *, axes: int, partitions: int, workers: int) -> Path:
    """Write fleet.toml and a file for each axis; returns the path of fleet.toml."""
    (folder / "axes").mkdir(parents=True, exist_ok=True)
    for number in range(axes):
        text = _AXIS.format(machine=number // 2 + 1, axis="xy"[number % 2], frequencies=_FREQUENCIES, window=WINDOW)
        (folder / "axes" / f"axis-{number + 1:02d}.toml").write_text(text)
    path = folder / "fleet.toml"
    path.write_text(
        f'axes = ["axes/*.toml"]\npartitions = {partitions}\nworkers = {workers}\n\n'
        f"[log]\nurl = {json.dumps(url)}\nsize_gb = 1.0\nresults_gb = 1.0\n"
    )
    return path


class SimulatedMachines:
    """The axes of a simulated fleet, each with noise of its own, while the context lasts.

    Parameters
    ----------
    settings
        Of a fleet from `write_simulated_fleet`.
    buffer_bytes
        Size of the buffer of each axis.
    """

    def __init__(self, settings: FleetSettings, buffer_bytes: int = 16 * FILE_BYTES) -> None:
        self.keys = sorted(settings.read_axes())
        self._settings = settings
        file_bytes = min(FILE_BYTES, buffer_bytes // 4)
        self._buffers = [EdgeBuffer(settings.edge.buffer / key, buffer_bytes, file_bytes) for key in self.keys]
        self._edges = [Edge(key, buffer) for key, buffer in zip(self.keys, self._buffers)]
        axis = BeltAxis(
            excitation_n_m=excitation.multisine(Lines.parse(_FREQUENCIES, RATE_HZ, WINDOW)),
            sensor=Sensor(),
            seconds=_SIMULATED_S,
            run_in_s=0.5,
        )
        block, _ = SimulatedAxis(axis).run()
        self._signals = np.array([block[name] for name in _CHANNELS])
        self._channels = tuple(channel for name in _CHANNELS for channel in block.channels if channel.name == name)
        self._ended = threading.Event()
        self._threads = ThreadPoolExecutor(2, "livebode simulated machines")
        self.sent = 0
        """Batches of each axis until now."""

    @property
    def dropped(self) -> int:
        """Messages that the buffers have dropped because they were full."""
        return sum(buffer.dropped for buffer in self._buffers)

    def batch(self, axis: int, number: int) -> Batch:
        """The batch of an axis with this number."""
        samples = round(BLOCK_S * RATE_HZ)
        first = number * samples
        places = np.arange(first, first + samples) % self._signals.shape[1]
        data = self._signals[:, places]
        noise = np.random.default_rng([axis, number]).standard_normal(samples)
        data[2] *= 1 + 0.01 * axis
        data[2] += 1e-3 * noise
        return Batch(first, data.astype("f4").astype("f8"), self._channels, RATE_HZ, epoch=axis + 1)

    def __enter__(self) -> Self:
        self._measuring = self._threads.submit(self._measure)
        self._sending = self._threads.submit(self._send)
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._threads.shutdown()
        for buffer in self._buffers:
            buffer.close()
        self._measuring.result()
        self._sending.result()

    def _measure(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(max(0.0, began + (self.sent + 1) * BLOCK_S - time.monotonic())):
            self._add_batches(self.sent)
            self.sent += 1

    def _add_batches(self, number: int) -> None:
        for axis, edge in enumerate(self._edges):
            edge.add(self.batch(axis, number))

    def _send(self) -> None:
        edges = [(edge, self._measuring) for edge in self._edges]
        asyncio.run(send_edges(self._settings.log, edges, threading.Event()))


PARTITIONS = 8
_NAME = "livebode demo"
_STEP_S, _DRAIN_S = 0.25, 30.0


@dataclass(frozen=True)
class DemoResult:
    """What the demonstration gave: the check, and the longest time without a new result after the kill."""

    check: CheckResult
    silence_s: float


def demo(folder: Path, *, axes: int, workers: int, seconds: float, say: Callable[[str], None]) -> DemoResult:
    """Run the demonstration in a folder; `say` gets what happens, in sentences.

    Raises
    ------
    FleetError
        If nats-server is not installed.
    ExtraError
        If a package of the extra "fleet" is not installed.
    """
    with LogServer(folder / "log", PARTITIONS) as server:
        path = write_simulated_fleet(folder, server.url, axes=axes, partitions=PARTITIONS, workers=workers)
        settings = FleetSettings.read(path)
        configured = settings.read_axes()
        say(f"nats-server stores the log at {server.url}")
        with_log(settings.log, _NAME, lambda log: log.create_streams())
        with FleetCoordinator(settings, configured) as coordinator:
            say(f"{workers} workers share {PARTITIONS} partitions")
            with SimulatedMachines(settings) as machines:
                say(f"{axes} axes send {RATE_HZ:g} samples per second each")
                _wait(coordinator, seconds / 2)
                killed_s = _kill(settings, configured, say)
                _wait(coordinator, seconds / 2)
            say(f"the axes stop after {machines.sent} messages each")
            _drain(coordinator, settings, configured)
            say(_shares(settings, configured))
        silent_s = with_log(settings.log, _NAME, lambda log: silences(log, killed_s, time.time()))
        longest = max(silent_s.values(), default=0.0)
        say(f"longest time without a new result in a partition after the kill: {longest:.1f} s")
        say("computing all responses again from the log, in one process without interruption")
        return DemoResult(with_log(settings.log, _NAME, lambda log: check_results(log, configured)), longest)


def _wait(coordinator: FleetCoordinator, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        coordinator.step()
        time.sleep(_STEP_S)


def _kill(settings: FleetSettings, axes: dict[str, Axis], say: Callable[[str], None]) -> float:
    owners = _owners(settings, axes)
    victim = max(owners, key=owners.__getitem__)
    os.kill(int(victim.rpartition(":")[2]), signal.SIGKILL)
    say(f"kill -9 of worker {victim}, the owner of {counted(owners[victim], 'partition')}")
    return time.time()


def _owners(settings: FleetSettings, axes: dict[str, Axis]) -> Counter[str]:
    status = with_log(settings.log, _NAME, lambda log: fleet_status(log, axes))
    return Counter(partition["owner"] for partition in status["partitions"])


def _shares(settings: FleetSettings, axes: dict[str, Axis]) -> str:
    owners = _owners(settings, axes)
    return f"partitions of each worker now: {', '.join(str(count) for _, count in sorted(owners.items()))}"


def _drain(coordinator: FleetCoordinator, settings: FleetSettings, axes: dict[str, Axis]) -> None:
    """Wait until the owners have processed what the log has."""
    until = time.monotonic() + _DRAIN_S
    while time.monotonic() < until:
        _wait(coordinator, 1.5)
        if not with_log(settings.log, _NAME, lambda log: fleet_status(log, axes))["log"]["waiting"]:
            return
