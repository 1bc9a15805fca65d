"""A small fleet on a real log: axes that send numbered samples, and owners of its partitions in processes."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Mapping
from multiprocessing.context import ForkServerProcess
from typing import Any

import numpy as np

from livebode.configuration import Axis
from livebode.core import Channel
from livebode.sources.live import Batch
from livebode_plant.fleet.fleet_settings import LogSection, machine_key
from livebode_plant.fleet.log import ClaimLostError, FleetLog
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.partition import PartitionOwner
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.replay import CheckResult, check_results
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.status import status_of
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM, RESULT_STREAM, RESULTS
from livebode_plant.fleet.worker import own_partitions
from tests.support.forked import server

RATE_HZ = 1000.0
WINDOW, SAMPLES = 100, 50
PARTITIONS = 4
CHANNELS = (Channel("w", "N m"), Channel("u", "N m"), Channel("y", "m/s"))
EPOCH = 77
_T = np.arange(10 * WINDOW) / RATE_HZ


def log_section(url: str) -> LogSection:
    return LogSection(url=url, size_gb=0.5, results_gb=0.5)


def fleet_axes(count: int) -> dict[str, Axis]:
    """Axes by their key in the log."""
    found = {}
    for number in range(count):
        axis = Axis.of(
            {
                "machine": {"site": "ulm", "machine": f"press {number}", "axis": "x"},
                "source": {"url": "udp://127.0.0.1:5000"},
                "signals": {"output": "y", "input": "u", "excitation": "w"},
                "lines": {"frequencies": "20:100:20", "window": WINDOW},
                "tracking": {"hop": 25},
            },
            "a test",
        )
        found[machine_key(axis, "a test")] = axis
    return found


def batch(axis: int, first: int, epoch: int = EPOCH) -> Batch:
    """Samples of an axis from number `first` on; every axis and every period has noise of its own."""
    rng = np.random.default_rng([axis, first, epoch])
    at = np.arange(first, first + SAMPLES) % len(_T)
    w = sum(np.cos(2 * np.pi * f * _T[at] + f) for f in (20, 40, 60, 80, 100))
    u, y = 0.7 * w, np.roll(w, 1) * (axis + 1) + 0.01 * rng.standard_normal(SAMPLES)
    return Batch(first, np.vstack([w, u, y]).astype("f4").astype("f8"), CHANNELS, RATE_HZ, epoch)


async def send(log: FleetLog, axes: Mapping[str, Axis], firsts: range) -> None:
    """Publish the batches that begin at these numbers, for all axes."""
    for first in firsts:
        for number, key in enumerate(axes):
            message = write_message(batch(number, first))
            await log.append(f"{EDGE}.{key}", message, message_id(key, message))


def sent(settings: LogSection, axes: Mapping[str, Axis], batches: int, first: int = 0) -> None:
    """The same from a program without a loop: `batches` of them from batch number `first` on."""

    async def publish() -> None:
        async with FleetLog(settings, "test") as log:
            await log.create_streams()
            await send(log, axes, range(first * SAMPLES, (first + batches) * SAMPLES, SAMPLES))

    asyncio.run(publish())


class UnfencedOwner(PartitionOwner):
    """The control: an owner that stores its results whoever owns the partition."""

    async def _append(self, message: Any) -> int:
        while True:
            last = await self._log.last(RESULT_STREAM, self._subject)
            try:
                return await self._log.append_after(
                    RESULT_STREAM, self._subject, message.to_bytes(), 0 if last is None else last.number
                )
            except ClaimLostError:
                continue

    async def _check_claim(self) -> None:
        pass


def start_owner(
    settings: LogSection, axes: Mapping[str, Axis], kind: type[PartitionOwner] = PartitionOwner
) -> ForkServerProcess:
    """A process that owns all partitions until it is killed."""
    process = server().Process(target=_own, args=(settings, dict(axes), kind), daemon=True)
    process.start()
    return process


def _own(settings: LogSection, axes: Mapping[str, Axis], kind: type[PartitionOwner]) -> None:
    own_partitions(settings, axes, range(PARTITIONS), threading.Event(), kind)


def owned_until_current(settings: LogSection, axes: Mapping[str, Axis], responses: int = 0) -> None:
    """Own all partitions in a thread until everything in the log is processed, and stop in order.

    In a cluster a server that has just started may not know of everything yet: `responses` must be stored too.
    """
    stop = threading.Event()
    thread = threading.Thread(target=own_partitions, args=(settings, axes, range(PARTITIONS), stop))
    thread.start()
    try:
        asyncio.run(_until_current(settings, axes))
        while responses and stored_responses(settings) < responses:
            time.sleep(0.1)
    finally:
        stop.set()
        thread.join()


async def _until_current(settings: LogSection, axes: Mapping[str, Axis]) -> None:
    """Wait until every partition reports that it waits for nothing, and has processed all messages of its axes."""
    async with FleetLog(settings, "test") as log:
        began_s = time.time()
        for number in range(PARTITIONS):
            while True:
                about = await status_of(log, number)
                newest = {key: await log.last(LOG_STREAM, f"{LOG}.{number}.{key}") for key in axes}
                due = {key: message.number for key, message in newest.items() if message is not None}
                if about is not None and about["at_s"] > began_s and not about["waiting"]:
                    done = {key: axis["position"] for key, axis in about["axes"].items()}
                    if all(done.get(key, 0) >= last for key, last in due.items()):
                        break
                await asyncio.sleep(0.05)


def stored_responses(settings: LogSection) -> int:
    """How many responses are stored, doubled ones included."""

    async def count() -> int:
        async with FleetLog(settings, "count") as log:
            last = (await log.extent(RESULT_STREAM)).last
            return sum(
                [
                    ResultMessage.from_bytes(message.data).rows.num_rows
                    async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last)
                ]
            )

    return asyncio.run(count())


def checked(settings: LogSection, axes: Mapping[str, Axis]) -> CheckResult:
    async def check() -> CheckResult:
        async with FleetLog(settings, "check") as log:
            return await check_results(log, axes)

    return asyncio.run(check())
