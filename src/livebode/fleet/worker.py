"""A process that owns partitions: the body of a task of the coordinator, and a plain process for tests."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor

from livebode.configuration.axis import Axis
from livebode.fleet.log import FleetLog
from livebode.fleet.partition import PartitionOwner
from livebode.fleet.settings import LogSection


def own_partitions(
    log: LogSection,
    axes: Mapping[str, Axis],
    numbers: Iterable[int],
    stop: threading.Event,
    kind: type[PartitionOwner] = PartitionOwner,
) -> list[bool]:
    """Own partitions until `stop` is set; returns for each whether it was stopped, or claimed by another process."""
    return asyncio.run(_own(log, axes, list(numbers), stop, kind))


async def _own(
    settings: LogSection,
    axes: Mapping[str, Axis],
    numbers: list[int],
    stop: threading.Event,
    kind: type[PartitionOwner],
) -> list[bool]:
    # Partitions compute one after another: several at once would take as long, and each of them until the end.
    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(1))
    stopped = asyncio.Event()

    async def own(number: int) -> bool:
        async with FleetLog(settings, f"livebode partition {number}") as log:
            return await kind(log, number, axes).run(stopped)

    watching = asyncio.create_task(_watch(stop, stopped))
    try:
        return list(await asyncio.gather(*map(own, numbers)))
    finally:
        watching.cancel()


async def _watch(stop: threading.Event, stopped: asyncio.Event) -> None:
    while not stop.is_set():
        await asyncio.sleep(0.1)
    stopped.set()
