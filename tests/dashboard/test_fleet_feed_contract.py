"""The feed over a real nats-server: states reach the page, acts reach all pages and those that open later."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core.errors import FleetError
from livebode.dashboard.alarm_requests import AlarmRequest
from livebode.dashboard.fleet_board import LOOKS
from livebode.dashboard.fleet_feed import NatsFeed
from livebode.dashboard.fleet_view import FleetView
from livebode.fleet.server import LogServer
from livebode.fleet.status_message import ACTIVE, AXIS_STATUS, AxisName, PartitionNames, encode_names, encode_status


class Worker:
    """The owner of a partition: a status ten times a second, its names when it is asked."""

    def __init__(self, url: str) -> None:
        self._url = url
        self.asked = 0

    async def run(self) -> None:
        import nats

        connection = await nats.connect(self._url)
        axes = (AxisName("hall/press/x"), AxisName("hall/press.2/y *"))
        names, table = encode_names(PartitionNames(0, "w", axes, ("", "change")), 1.0)
        status = np.zeros(2, AXIS_STATUS)
        status["axis"], status["state"] = [0, 1], 1
        status[1]["raised"], status[1]["flags"], status[1]["raised_s"] = 1, ACTIVE, 50

        async def answer(_: Any) -> None:
            self.asked += 1
            await connection.publish("names.0", names)

        await connection.subscribe("names.ask.0", cb=answer)
        try:
            while True:
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
    return FleetView(NatsFeed(url, "plant"), browsers=1)


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
        assert worker.asked <= 4, "names are asked for, not sent each second"


def test_pages_of_one_fleet_show_the_same_acts(tmp_path: Path) -> None:
    with LogServer(tmp_path, 4) as server:
        asyncio.run(use(server.url))


def test_a_log_that_is_not_there_is_reported(tmp_path: Path) -> None:
    server = LogServer(tmp_path, 4)

    async def use_it() -> None:
        feed = NatsFeed(server.url, "plant")
        with pytest.raises(FleetError, match="cannot be reached"):
            await feed.connect()

    asyncio.run(use_it())
