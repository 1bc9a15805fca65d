"""The buffer of an edge: restarts, torn files, a full disk quota; and what the log makes of senders."""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Channel, SpectraLayout
from livebode.core.errors import FleetError
from livebode.fleet.edge import Edge
from livebode.fleet.edge_buffer import EdgeBuffer
from livebode.fleet.log import FleetLog
from livebode.fleet.message import read_message, write_message
from livebode.fleet.server import LogServer
from livebode.fleet.subjects import LOG_STREAM
from livebode.sources.live import Batch, SpectraBatch
from tests.support.fleet_runs import CHANNELS, PARTITIONS, RATE_HZ, batch, fleet_axes, log_section


def _drained(buffer: EdgeBuffer, most: int = 1 << 30) -> list[bytes]:
    found = []
    while len(found) < most and (message := buffer.first()) is not None:
        found.append(message)
        buffer.remove(message)
    return found


def test_messages_come_back_in_order_after_a_restart(tmp_path: Path) -> None:
    messages = [bytes([number]) * 100 for number in range(50)]
    before = EdgeBuffer(tmp_path, 1 << 20, file_bytes=1000)
    for message in messages:
        before.append(message)
    taken = _drained(before, 25)
    before.close()
    after = EdgeBuffer(tmp_path, 1 << 20, file_bytes=1000)
    again = _drained(after)
    assert taken == messages[:25]
    assert again[-25:] == messages[25:]
    assert again == messages[-len(again) :]  # the rest of one file may be sent again
    assert len(again) - 25 < 10
    assert after.dropped == 0
    after.close()


@given(st.integers(1, 107))
@settings(max_examples=20, deadline=None)
def test_a_torn_end_costs_the_torn_message_alone(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    folder = tmp_path_factory.mktemp("buffer")
    buffer = EdgeBuffer(folder, 1 << 20)
    for number in range(3):
        buffer.append(bytes([number]) * 100)
    buffer.close()
    (file,) = folder.iterdir()
    file.write_bytes(file.read_bytes()[:-cut])
    after = EdgeBuffer(folder, 1 << 20)
    after.append(b"new")
    assert _drained(after) == [b"\0" * 100, b"\1" * 100, b"new"]
    assert after.damaged == 1
    after.close()


def test_a_full_buffer_drops_the_oldest_and_counts_each(tmp_path: Path) -> None:
    buffer = EdgeBuffer(tmp_path, 5000, file_bytes=1000)
    messages = [bytes([number]) * 100 for number in range(200)]
    for message in messages:
        buffer.append(message)
    assert buffer.size_bytes <= 6000
    rest = _drained(buffer)
    assert rest == messages[-len(rest) :]
    assert buffer.dropped == len(messages) - len(rest)
    buffer.close()


def test_a_directory_that_cannot_be_used_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(FleetError, match="cannot be read or written"):
        EdgeBuffer(tmp_path / "file", 1000)


def test_a_message_has_the_bits_of_its_batch() -> None:
    exact = batch(1, 50)
    wide = Batch(7, np.array([[0.1], [np.nan], [1e300]]), CHANNELS, RATE_HZ, 5)
    for one in (exact, wide):
        again = read_message(write_message(one), 3.0)
        assert isinstance(again, Batch)
        assert np.array_equal(again.data, one.data, equal_nan=True)
        assert (again.first_sample, again.epoch, again.channels, again.arrived_s) == (
            one.first_sample,
            one.epoch,
            one.channels,
            3.0,
        )
    assert len(write_message(exact)) < len(write_message(Batch(50, exact.data * 0.1, CHANNELS, RATE_HZ, 5)))


def test_spectra_pass_the_log_too() -> None:
    layout = SpectraLayout((Channel("w"), Channel("y")), (Channel("x"),), window=100, hop=20, lines=(2, 4))
    rng = np.random.default_rng(1)
    sums = rng.standard_normal((2, 3, 2)) + 1j * rng.standard_normal((2, 3, 2))
    one = SpectraBatch(40, sums, rng.standard_normal((1, 3)), np.zeros(3, np.uint32), layout, RATE_HZ, 5)
    again = read_message(write_message(one), 3.0)
    assert isinstance(again, SpectraBatch)
    assert again.layout == layout
    assert np.array_equal(again.sums, sums)
    assert np.array_equal(again.values, one.values)
    assert again.first_sample == 40


def test_an_edge_outlasts_the_log_and_stores_each_message_once(tmp_path: Path) -> None:
    server = LogServer(tmp_path / "log", PARTITIONS)
    key = next(iter(fleet_axes(1)))
    buffer = EdgeBuffer(tmp_path / "edge", 1 << 20)
    edge, taking = Edge(key, buffer), Future[None]()

    async def outage() -> int:
        async with FleetLog(log_section(server.url), "test") as log:
            await log.create_streams()
            sending = asyncio.create_task(edge.send(log, taking))
            for first in range(0, 500, 50):
                edge.take(batch(0, first))
            await asyncio.to_thread(server.kill)
            for first in range(500, 1000, 50):
                edge.take(batch(0, first))
            await asyncio.to_thread(server.start)
            taking.set_result(None)
            await sending
            return (await log.extent(LOG_STREAM)).last

    with server:
        assert asyncio.run(outage()) == 20
    assert edge.sent == 20
    assert len(buffer) == 0
    buffer.close()
