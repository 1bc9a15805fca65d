"""What a worker does: it owns partitions until it is stopped, or until others have claimed them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor

from livebode.configuration import Axis
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.partition import PartitionOwner

_AGAIN_S = 1.0
"""After which an owner that failed begins again."""
_logger = logging.getLogger(f"livebode.{__name__}")


def own_partitions(
    log: LogSection,
    axes: Mapping[str, Axis],
    numbers: Iterable[int],
    stop: threading.Event,
    kind: type[PartitionOwner] = PartitionOwner,
) -> list[bool]:
    """Own partitions until `stop` is set; returns for each whether it was stopped, or claimed by another process.

    An owner that fails is reported, and begins again after a second: the others of its process continue.
    """
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
        while not stopped.is_set():
            try:
                async with FleetLog(settings, f"livebode partition {number}") as log:
                    return await kind(log, number, axes).run(stopped)
            except Exception as error:
                _logger.error("the owner of partition %d failed, and begins again: %s", number, error)
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stopped.wait(), _AGAIN_S)
        return True

    watching = asyncio.create_task(_watch(stop, stopped))
    try:
        return list(await asyncio.gather(*map(own, numbers)))
    finally:
        watching.cancel()


async def _watch(stop: threading.Event, stopped: asyncio.Event) -> None:
    while not stop.is_set():
        await asyncio.sleep(0.1)
    stopped.set()
