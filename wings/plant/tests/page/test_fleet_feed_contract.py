"""The feed over a real nats-server: states reach the page, acts reach all pages and those that open later."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import FleetError
from livebode.dashboard import AlarmRequest
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status_message import (
    ACTIVE,
    AXIS_STATUS,
    AxisName,
    PartitionNames,
    encode_names,
    encode_status,
)
from livebode_plant.fleet.worker import own_partitions
from livebode_plant.page.fleet_board import LOOKS
from livebode_plant.page.fleet_feed import NatsFeed
from livebode_plant.page.fleet_pages import FleetView
from tests.support.fleet_runs import PARTITIONS, SAMPLES, fleet_axes, log_section, send, sent


class Worker:
    """The owner of a partition: a status ten times a second, its names each second."""

    def __init__(self, url: str) -> None:
        self._url = url

    async def run(self) -> None:
        import nats

        connection = await nats.connect(self._url)
        axes = (AxisName("hall/press/x"), AxisName("hall/press.2/y *"))
        names, table = encode_names(PartitionNames(0, "w", axes, ("", "change")), 1.0)
        status = np.zeros(2, AXIS_STATUS)
        status["axis"], status["state"] = [0, 1], 1
        status[1]["raised"], status[1]["flags"], status[1]["raised_s"] = 1, ACTIVE, 50
        try:
            for beat in itertools.count():
                if beat % 10 == 5:
                    await connection.publish("names.0", names)
                await connection.publish("view.0", encode_status(0, table, status, time.time()))
                await connection.publish("view.0", b"{}")  # a stranger's
                await asyncio.sleep(0.1)
        finally:
            await connection.close()


@contextlib.asynccontextmanager
async def running(*jobs: Any) -> AsyncIterator[None]:
    tasks = [asyncio.create_task(job.run()) for job in jobs]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def looks(view: FleetView, *expected: str) -> None:
    """Wait until a page shows this; pytest's own limit ends a wait in vain."""
    async with asyncio.timeout(20):
        while [LOOKS[n] for n in view.board.looks] != list(expected):
            await asyncio.sleep(0.02)


def opened(url: str) -> FleetView:
    return FleetView(NatsFeed(log_section(url), "plant"), browsers=1)


async def use(url: str) -> None:
    one, two, later, worker = opened(url), opened(url), opened(url), Worker(url)
    async with running(worker, one, two):
        await looks(one, "ok", "alarm")
        await looks(two, "ok", "alarm")
        asked = AlarmRequest(1, f"{one.board.layout}:1", "Ann")
        await one.act("acknowledge", asked)
        await looks(one, "ok", "acknowledged")
        await looks(two, "ok", "acknowledged")
        await two.act("shelve", AlarmRequest(1, f"{two.board.layout}:1", "Bo", "waits for a part", 30.0))
        await looks(one, "ok", "shelved")
        async with running(later):
            await looks(later, "ok", "shelved")
            await later.act("unshelve", AlarmRequest(1, f"{later.board.layout}:1", "Bo"))
            await looks(later, "ok", "acknowledged")
        assert one.board.axes.dropped > 0


def test_pages_of_one_fleet_show_the_same_acts(tmp_path: Path) -> None:
    with LogServer(tmp_path, 4) as server:
        asyncio.run(use(server.url))


def test_the_owners_of_partitions_report_to_the_page(tmp_path: Path) -> None:
    """A real fleet: what was sent is tracked; an axis that loses samples has an alarm that is over."""
    with LogServer(tmp_path, PARTITIONS) as server:
        log, axes, stop = log_section(server.url), fleet_axes(3), threading.Event()
        sent(log, axes, 8)
        owners = threading.Thread(target=own_partitions, args=(log, axes, range(PARTITIONS), stop))
        owners.start()
        try:
            asyncio.run(follow(server.url, log, axes))
        finally:
            stop.set()
            owners.join()


async def follow(url: str, section: LogSection, axes: dict[str, Axis]) -> None:
    view = opened(url)
    async with running(view), FleetLog(section, "test") as log:
        await looks(view, *["silent"] * 3)
        assert view.board.paths == [f"ulm/press {n}/x" for n in range(3)]
        first = 12 * SAMPLES  # four batches are missing
        await send(
            log, dict(list(axes.items())[:1]), range(first, first + 40 * SAMPLES, SAMPLES)
        )  # the sequencer waits for late ones
        await looks(view, "returned", "silent", "silent")
        assert view.board.gaps()["lost"] == 4 * SAMPLES
        assert view.board.workers(time.time())["silent_count"] == 0
        assert view.board.axes.dropped == 0


def test_a_log_that_is_not_there_is_reported(tmp_path: Path) -> None:
    server = LogServer(tmp_path, 4)

    async def use_it() -> None:
        feed = NatsFeed(log_section(server.url), "plant")
        with pytest.raises(FleetError, match="cannot be reached"):
            await feed.connect()

    asyncio.run(use_it())
