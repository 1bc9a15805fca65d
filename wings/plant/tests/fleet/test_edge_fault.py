"""The buffer of an edge: restarts, torn files, a full disk quota; and what the log makes of senders."""

from __future__ import annotations

import asyncio
import os
import resource
import shutil
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Channel, FleetError, SpectraLayout
from livebode.sources.live import Batch, SpectraBatch
from livebode_plant.fleet import edge as edge_module
from livebode_plant.fleet.edge import Edge, SoleSender, edge_buffers, send_edges
from livebode_plant.fleet.edge_buffer import EdgeBuffer
from livebode_plant.fleet.fleet_settings import EdgeSection, LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import read_message, write_message
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import LOG, LOG_STREAM
from tests.support.fleet_runs import CHANNELS, PARTITIONS, RATE_HZ, batch, fleet_axes, log_section


def _drained(buffer: EdgeBuffer, most: int = 1 << 30) -> list[bytes]:
    found = list[bytes]()
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


def test_the_axes_of_an_edge_share_the_space_of_its_buffer(tmp_path: Path) -> None:
    with edge_buffers(EdgeSection(buffer=tmp_path, buffer_gb=0.008), ["x", "y"]) as buffers:
        for number in range(60):
            buffers["x"].append(bytes([number]) * 100_000)
        assert 3_000_000 < buffers["x"].size_bytes <= 4_000_000
        assert (buffers["x"].dropped + len(buffers["x"]), buffers["y"].dropped) == (60, 0)
        assert _drained(buffers["x"])[-1] == bytes([59]) * 100_000


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


@contextmanager
def _full_disk(room: int) -> Iterator[None]:
    """Files grow to so many bytes and no further, as on a full disk: the last write is cut."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_what_a_full_disk_accepts_survives_and_the_rest_is_refused(tmp_path: Path) -> None:
    buffer, accepted = EdgeBuffer(tmp_path, 1 << 20), list[bytes]()
    for number in range(60):
        message = bytes([number]) * 100
        with _full_disk(room=2000 if number < 40 else resource.RLIM_INFINITY):
            try:
                buffer.append(message)
            except FleetError:
                continue
        accepted.append(message)
    buffer.close()
    assert 10 < len(accepted) < 60
    assert accepted[-20:] == [bytes([number]) * 100 for number in range(40, 60)]
    after = EdgeBuffer(tmp_path, 1 << 20)
    assert (_drained(after), after.damaged) == (accepted, 0)
    after.close()


def test_a_buffer_is_used_by_one_process_at_a_time(tmp_path: Path) -> None:
    buffer = EdgeBuffer(tmp_path, 1 << 20)
    with pytest.raises(FleetError, match="another process uses the buffer"):
        EdgeBuffer(tmp_path, 1 << 20)
    buffer.close()
    EdgeBuffer(tmp_path, 1 << 20).close()


def test_a_power_cut_costs_what_was_appended_after_the_last_sync(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a file had at its last sync is on the disk; of the rest nothing is certain."""
    safe: dict[Path, int] = {}
    sync = os.fdatasync

    def noted(file: int) -> None:
        sync(file)
        safe[Path(os.readlink(f"/proc/self/fd/{file}"))] = os.fstat(file).st_size

    monkeypatch.setattr(os, "fdatasync", noted)
    buffer = EdgeBuffer(tmp_path / "buffer", 1 << 20, file_bytes=1000)
    messages = [bytes([number]) * 100 for number in range(50)]
    for number, message in enumerate(messages):
        buffer.append(message)
        if number % 13 == 3 or number == 44:
            buffer.sync()
    shutil.copytree(tmp_path / "buffer", tmp_path / "cut")
    for path in (tmp_path / "cut").iterdir():
        os.truncate(path, safe.get(tmp_path / "buffer" / path.name, 0))
    after = EdgeBuffer(tmp_path / "cut", 1 << 20)
    assert _drained(after) == messages[:45]
    after.close()
    buffer.close()


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
                edge.add(batch(0, first))
            await asyncio.to_thread(server.kill)
            for first in range(500, 1000, 50):
                edge.add(batch(0, first))
            await asyncio.to_thread(server.start)
            taking.set_result(None)
            await sending
            return (await log.extent(LOG_STREAM)).last

    with server:
        assert asyncio.run(outage()) == 20
    assert edge.sent == 20
    assert len(buffer) == 0
    buffer.close()


def test_an_edge_that_starts_while_the_log_is_away_buffers(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Also twice, as a service manager starts it again; everything is in the log once when that returns."""
    server = LogServer(tmp_path / "log", PARTITIONS)
    key, sent = next(iter(fleet_axes(1))), 0

    async def run(firsts: range, *, last: bool) -> int:
        buffer = EdgeBuffer(tmp_path / "edge", 1 << 20)
        edge, taking, stop = Edge(key, buffer), Future[None](), threading.Event()
        sending = asyncio.create_task(send_edges(log_section(server.url), [(edge, taking)], stop))
        for first in firsts:
            edge.add(batch(0, first))
            await asyncio.sleep(0)
        if last:
            await asyncio.to_thread(server.start)
            taking.set_result(None)
        else:
            await asyncio.sleep(0.3)
            stop.set()
        await sending
        buffer.close()
        return edge.sent

    async def stored() -> int:
        async with FleetLog(log_section(server.url), "test") as log:
            return (await log.extent(LOG_STREAM)).last

    try:
        for number in range(3):
            sent += asyncio.run(run(range(500 * number, 500 * (number + 1), 50), last=number == 2))
        assert (sent, asyncio.run(stored())) == (30, 30)
        assert caplog.text.count("the log does not answer") == 3
    finally:
        server.kill()


def test_a_full_disk_does_not_matter_while_the_log_is_there_and_holds_up_the_source_while_it_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(edge_module, "HELD_BYTES_MAX", 3000)
    monkeypatch.setattr(edge_module, "QUIET_S", 0.1)
    server = LogServer(tmp_path / "log", PARTITIONS)
    key = next(iter(fleet_axes(1)))
    buffer = EdgeBuffer(tmp_path / "edge", 1 << 20)
    edge, taken = Edge(key, buffer), list[int]()

    def refuse(_message: bytes) -> None:
        raise FleetError("buffer-unusable", "the buffer cannot be written: No space left on device")

    def take(first: int, last: int) -> None:
        for number in range(first, last, 50):
            edge.add(batch(0, number))
            taken.append(number)

    async def stored(count: int) -> None:
        async with FleetLog(log_section(server.url), "test") as log:
            await log.create_streams()
            while (await log.extent(LOG_STREAM)).last < count:
                await asyncio.sleep(0.02)

    async def run() -> None:
        taking, stop = Future[None](), threading.Event()
        sending = asyncio.create_task(send_edges(log_section(server.url), [(edge, taking)], stop))
        with monkeypatch.context() as patch:
            patch.setattr(buffer, "append", refuse)
            await asyncio.to_thread(take, 0, 1000)
            await stored(20)
            await asyncio.to_thread(server.kill)
            waiting = asyncio.create_task(asyncio.to_thread(take, 1000, 2000))
            await asyncio.sleep(0.5)
            assert 20 <= len(taken) < 30
        await waiting  # the disk has room again
        assert len(buffer) >= 10
        await asyncio.to_thread(server.start)
        taking.set_result(None)
        await sending
        await stored(40)

    with server:
        asyncio.run(run())
    assert edge.sent == 40
    buffer.close()


def test_a_second_sender_of_an_axis_waits_for_the_end_of_the_first_and_both_are_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """An edge that was copied with its configuration; each has its own buffer, and another epoch."""
    monkeypatch.setattr(edge_module, "QUIET_S", 0.5)
    key = next(iter(fleet_axes(1)))

    async def run(settings: LogSection) -> list[int]:
        buffers = [EdgeBuffer(tmp_path / name, 1 << 20) for name in ("first", "second")]
        edges = [Edge(key, buffer) for buffer in buffers]
        taking, stop = [Future[None](), Future[None]()], threading.Event()
        sending = []
        for number in range(40):
            if number in (0, 10):
                sending.append(
                    asyncio.create_task(send_edges(settings, [(edges[number // 10], taking[number // 10])], stop))
                )
            for epoch, edge in enumerate(edges[: len(sending)], 1):
                edge.add(batch(0, 50 * number, epoch))
            await asyncio.sleep(0.05)
        assert edges[1].sent == 0
        taking[0].set_result(None)
        await sending[0]
        taking[1].set_result(None)
        await sending[1]
        for buffer in buffers:
            buffer.close()
        async with FleetLog(settings, "test") as log:
            last = (await log.extent(LOG_STREAM)).last
            stored = [message async for message in stored_messages(log, LOG_STREAM, f"{LOG}.>", last)]
        return [read_message(message.data, 0.0).epoch for message in stored]

    with LogServer(tmp_path / "log", PARTITIONS) as server:
        assert asyncio.run(run(log_section(server.url))) == [1] * 40 + [2] * 30
    assert caplog.text.count("another sender stores messages") == 1


def test_a_sender_continues_where_one_was_killed_and_one_that_was_frozen_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(edge_module, "QUIET_S", 0.2)
    key = next(iter(fleet_axes(1)))
    messages = [write_message(batch(0, first)) for first in range(0, 400, 50)]

    async def run(settings: LogSection) -> None:
        async with FleetLog(settings, "frozen") as first, FleetLog(settings, "next") as second:
            await first.create_streams()
            frozen, following = SoleSender(first, key), SoleSender(second, key)
            for message in messages[:2]:
                await frozen.send(message)
            for message in messages[:4]:  # two repeats: it did not learn that they are stored
                await following.send(message)
            returned = asyncio.create_task(frozen.send(messages[4]))
            for message in messages[5:]:
                await asyncio.sleep(0.15)
                assert not returned.done()
                await following.send(message)
            await returned
            assert (await first.extent(LOG_STREAM)).last == len(messages)

    with LogServer(tmp_path / "log", PARTITIONS) as server:
        asyncio.run(run(log_section(server.url)))
    assert caplog.text.count("another sender stores messages") == 1
