"""The reader of a log: many messages, large ones, and a server that forgets what it was asked for."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import MESSAGES_MAX, Delivery, Reader, StoredMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM
from tests.support.fleet_runs import log_section

SUBJECT = f"{EDGE}.ulm._.press.x"
Script = Callable[[FleetLog, Reader], Awaitable[list[StoredMessage]]]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path, 1) as one:
        yield one


def _run(server: LogServer, script: Script) -> list[StoredMessage]:
    async def run() -> list[StoredMessage]:
        async with FleetLog(log_section(server.url), "test") as log:
            await log.create_streams()
            reader = Reader(log, LOG_STREAM, f"{LOG}.0.>", 1)
            try:
                return await script(log, reader)
            finally:
                await reader.close()

    return asyncio.run(run())


async def _read(reader: Reader, count: int) -> list[StoredMessage]:
    found: list[StoredMessage] = []
    while len(found) < count:
        found += await reader.read(0.05)
    return found


def test_more_messages_than_one_request_returns_come_in_order(server: LogServer) -> None:
    count = 2 * MESSAGES_MAX + 100

    async def script(log: FleetLog, reader: Reader) -> list[StoredMessage]:
        for number in range(count - 1):
            await log.publish(SUBJECT, str(number).encode())
        await log.append(SUBJECT, str(count - 1).encode())
        return await _read(reader, count)

    found = _run(server, script)
    assert [int(one.data) for one in found] == list(range(count))
    assert [one.number for one in found] == list(range(1, count + 1))


def test_messages_that_do_not_fit_into_one_answer_come_in_the_next(server: LogServer) -> None:
    async def script(log: FleetLog, reader: Reader) -> list[StoredMessage]:
        for number in range(3):
            await log.append(SUBJECT, bytes([number]) * (7 << 20))
        return await _read(reader, 3)

    found = _run(server, script)
    assert [one.data[0] for one in found] == list(range(3))


def test_a_reader_whose_consumer_was_removed_continues_after_what_it_returned(server: LogServer) -> None:
    async def script(log: FleetLog, reader: Reader) -> list[StoredMessage]:
        await log.append(SUBJECT, b"0")
        found = await _read(reader, 1)
        await log.append(SUBJECT, b"1")
        for consumer in await log._js.consumers_info(LOG_STREAM):
            await log._js.delete_consumer(LOG_STREAM, consumer.name)
        return found + await _read(reader, 1)

    assert [one.data for one in _run(server, script)] == [b"0", b"1"]


def test_a_reader_of_a_log_that_is_restarted_continues_after_what_it_returned(server: LogServer) -> None:
    async def script(log: FleetLog, reader: Reader) -> list[StoredMessage]:
        await log.append(SUBJECT, b"0")
        found = await _read(reader, 1)
        server.kill()
        server.start()
        await log.append(SUBJECT, b"1")
        return found + await _read(reader, 1)

    assert [one.data for one in _run(server, script)] == [b"0", b"1"]


@pytest.mark.parametrize(("before", "behind"), [("", ""), ("domain.account.", ""), ("domain.account.", ".random")])
def test_a_delivery_is_read_from_the_address_of_any_server(before: str, behind: str) -> None:
    found = Delivery.of(f"$JS.ACK.{before}LOG.name.1.7.3.1700000000500000000.2{behind}")
    assert found == (7, 3, 1700000000.5, 2)
