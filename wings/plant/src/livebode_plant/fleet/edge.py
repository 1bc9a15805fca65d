"""Edge: the batches of a live source, through a buffer on disk, into the log, by one sender for each axis."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Collection, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from livebode.core import FleetError
from livebode.sources.live import AnyBatch, Batch, LiveBlock, LiveSource, LiveSpectra, SpectraBatch
from livebode_plant.fleet.edge_buffer import EdgeBuffer
from livebode_plant.fleet.fleet_settings import EdgeSection, LogSection
from livebode_plant.fleet.log import FleetLog, OtherLastError
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.subjects import EDGE, axis_path

QUIET_S = 2.0
"""Time without a message of another sender after which this one begins."""
_SENTENCE_S = 60.0
_NO_NUMBER = 1 << 62
"""More than the number of any message: a message that is to follow it is refused, with the number of the last one."""


class SoleSender:
    """Sends the messages of one axis to the log.

    Each message names the number of the message that it follows, and the log refuses it if another one is there: an
    edge that was copied with its configuration cannot mix its samples into those of the original. A sender begins when
    nothing has been stored for `QUIET_S`, so that one that is started again continues at once, whatever became of its
    connection before, while a second one waits until the first has ended.

    Parameters
    ----------
    log
        The connection.
    key
        Of the axis.
    """

    def __init__(self, log: FleetLog, key: str) -> None:
        self._log, self._key, self._subject = log, key, f"{EDGE}.{key}"
        self._last: int | None = None
        self._reported_s = float("-inf")

    async def send(self, message: bytes) -> None:
        """Store a message; wait while another sender is active."""
        identity = message_id(self._key, message)
        while True:
            if self._last is None:
                self._last = await self._quiet_last()
            try:
                number = await self._log.append(self._subject, message, identity, self._last)
            except OtherLastError as error:
                # A lower number: the log was restored, or has deleted the messages of this axis. Without an answer to
                # an attempt before, the last message may be this one.
                if error.last <= self._last or error.repeated:
                    self._last = error.last
                else:
                    self._report()
                    self._last = None
            else:
                self._last = max(self._last, number)  # a repeat has the number that it got before
                return

    async def _quiet_last(self) -> int:
        """Number of the last message of the axis, when no other sender has stored one for some time."""
        last = await self._number_of_last()
        while last:
            await asyncio.sleep(QUIET_S)
            before, last = last, await self._number_of_last()
            if last == before:
                break
            self._report()
        return last

    async def _number_of_last(self) -> int:
        try:
            await self._log.append(self._subject, b"", after=_NO_NUMBER)
        except OtherLastError as error:
            return error.last
        raise AssertionError("the server has stored a message after a number that does not exist")

    def _report(self) -> None:
        if time.monotonic() - self._reported_s >= _SENTENCE_S:
            self._reported_s = time.monotonic()
            _logger.warning(
                "another sender stores messages of %s: this one waits, and its messages remain in its buffer; end one "
                "of them, or give it another [machine]",
                axis_path(self._key),
            )


SYNC_S = 1.0
"""Time between two syncs of a buffer."""
HELD_BYTES_MAX = 4 << 20
"""Most bytes of messages in memory that the disk does not take."""
_IDLE_S = 0.05
_REST_S = 1.0
_PASSING = ("fleet.log-unreachable", "fleet.log-refused", "fleet.log-untrusted")
"""Reasons against a connection that may pass without this computer: the server is down, or is set up again."""
_logger = logging.getLogger(f"livebode.{__name__}")


class Edge:
    """Sends the messages of a buffer to the log, in order, each until the log has stored it.

    What the disk does not take, because it is full for example, is kept in memory up to `HELD_BYTES_MAX`, and is sent
    from there or written later. Beyond that `add` waits, so that a sender that can wait does, and the source counts
    what others send.

    Parameters
    ----------
    key
        Of the axis.
    buffer
        To which the batches are appended.
    """

    def __init__(self, key: str, buffer: EdgeBuffer) -> None:
        self._key, self._buffer = key, buffer
        self._dropped = buffer.dropped
        self._room = threading.Condition()
        self._held: deque[bytes] = deque()
        self._held_bytes = 0
        self._ended = False
        self.sent = 0
        """Messages that the log has stored."""

    def add(self, batch: AnyBatch) -> None:
        """Append a batch to the buffer; may be called from any thread."""
        message = write_message(batch)
        with self._room:
            troubled = bool(self._held)
            self._held.append(message)
            self._held_bytes += len(message)
            self._write_held(troubled)
            while self._held_bytes > HELD_BYTES_MAX and not self._ended:
                self._room.wait(_IDLE_S)
                self._write_held(troubled=True)
        if self._buffer.dropped > self._dropped:
            lost, self._dropped = self._buffer.dropped - self._dropped, self._buffer.dropped
            _logger.warning("the buffer is full: the oldest %d messages were deleted", lost)

    def end(self) -> None:
        """Let `add` wait no longer."""
        with self._room:
            self._ended = True
            self._write_held(troubled=True)
            if self._held:
                _logger.warning(
                    "%d messages are lost: the log is away, and the disk did not take them", len(self._held)
                )

    async def send(self, log: FleetLog, taking: Future[None]) -> None:
        """Send until the thread that fills the buffer has ended, and the buffer is empty."""
        sender = SoleSender(log, self._key)
        while True:
            over = taking.done()
            message = self._first()
            if message is not None:
                await sender.send(message)
                self._remove(message)
                self.sent += 1
            elif over:
                return
            else:
                await asyncio.sleep(_IDLE_S)

    async def sync(self) -> None:
        """Sync the buffer once a second, which bounds what a power cut costs, until it is cancelled."""
        failed = False
        while True:
            await asyncio.sleep(SYNC_S)
            try:
                await asyncio.to_thread(self._sync)
            except OSError as error:
                if not failed:
                    _logger.warning("the buffer of %s cannot be synced: %s", axis_path(self._key), error)
                failed = True
            else:
                failed = False

    def _sync(self) -> None:
        with self._room:
            self._write_held(troubled=True)
        self._buffer.sync()

    def _write_held(self, troubled: bool) -> None:
        """Write what is in memory to the buffer, as far as the disk takes it; `troubled`: it is known not to."""
        try:
            while self._held:
                self._buffer.append(self._held[0])
                self._held_bytes -= len(self._held.popleft())
        except FleetError as error:
            if not troubled:
                _logger.warning("%s; new messages are kept in memory, then their source waits", error.message)

    def _first(self) -> bytes | None:
        with self._room:
            return self._buffer.first() or (self._held[0] if self._held else None)

    def _remove(self, message: bytes) -> None:
        with self._room:
            if self._held and self._held[0] is message:
                self._held_bytes -= len(self._held.popleft())
                self._room.notify()
            else:
                self._buffer.remove(message)


def sender_batches(source: LiveSource) -> Iterator[AnyBatch]:
    """The batches of an open source, with the numbers and epochs of its sender.

    A sender without epochs gets one from this computer's clock whenever it restarts, so that the log does not take
    its new numbers for repeats.
    """
    epochs: dict[int, int] = {}
    for block in source.blocks():
        assert isinstance(block, LiveBlock)
        assert block.origin is not None
        offset, epoch = block.origin.offset, block.origin.epoch
        if not epoch:
            if offset not in epochs:
                epochs = {offset: time.time_ns()}
            epoch = epochs[offset]
        first = block.start + offset
        if isinstance(block, LiveSpectra):
            values = np.array([block[channel.name] for channel in block.layout.values]).reshape(-1, len(block.state))
            yield SpectraBatch(first, block.sums, values, block.state, block.layout, block.rate_hz, epoch)
        else:
            yield Batch(first, block.data, block.channels, block.rate_hz, epoch)


@contextlib.contextmanager
def edge_buffers(settings: EdgeSection, keys: Collection[str]) -> Iterator[dict[str, EdgeBuffer]]:
    """The buffer of each axis, locked against other processes.

    Raises
    ------
    FleetError
        If one cannot be used, or another process uses it.
    """
    bytes_max = round(settings.buffer_gb * 1e9 / max(1, len(keys)))
    buffers: dict[str, EdgeBuffer] = {}
    with contextlib.ExitStack() as opened:
        for key in keys:
            buffers[key] = EdgeBuffer(settings.buffer / key, bytes_max)
            opened.callback(buffers[key].close)
        yield buffers


def send_sources(
    settings: LogSection, sources: Mapping[str, LiveSource], buffers: Mapping[str, EdgeBuffer], stop: threading.Event
) -> int:
    """Send the batches of open sources until they end, or until `stop` is set and a second has passed.

    What the log has not stored by then remains in the buffers, and is sent at the next start. Returns the number of
    messages that were stored.

    Parameters
    ----------
    settings
        Of the log.
    sources, buffers
        By the key of their axis.

    Raises
    ------
    SourceError
        If a source fails.
    """
    edges = {key: Edge(key, buffers[key]) for key in sources}
    with ThreadPoolExecutor(max(1, len(sources)), "livebode source") as threads:
        taking = [threads.submit(_add_all, source, edges[key]) for key, source in sources.items()]
        try:
            asyncio.run(send_edges(settings, list(zip(edges.values(), taking)), stop))
        finally:
            for key, source in sources.items():
                source.stop()
                edges[key].end()
    for thread in taking:
        thread.result()
    return sum(edge.sent for edge in edges.values())


def _add_all(source: LiveSource, edge: Edge) -> None:
    for batch in sender_batches(source):
        edge.add(batch)


async def send_edges(settings: LogSection, edges: list[tuple[Edge, Future[None]]], stop: threading.Event) -> None:
    """Send the messages of each edge until the thread that fills it has ended, or a second after `stop`.

    A log that cannot be reached is waited for, as long as it takes.

    Raises
    ------
    ConfigError, FleetError, ExtraError
        If the settings of the log cannot be used.
    """
    syncing = [asyncio.create_task(edge.sync()) for edge, _ in edges]
    sending = asyncio.create_task(_send_when_reachable(settings, edges))
    while not sending.done() and not stop.is_set():
        await asyncio.sleep(_IDLE_S)
    await asyncio.wait([sending], timeout=_REST_S)
    for task in (sending, *syncing):
        task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await sending


async def _send_when_reachable(settings: LogSection, edges: list[tuple[Edge, Future[None]]]) -> None:
    log, reported = FleetLog(settings, "livebode send"), ""
    while True:
        try:
            async with log:
                reported = ""
                await _send_all(log, edges)
            return
        except FleetError as error:
            if error.code not in _PASSING:
                raise
            if error.message != reported:
                reported = error.message
                _logger.warning("%s; the buffer collects the messages until it can be", reported)
        await asyncio.sleep(_REST_S)


async def _send_all(log: FleetLog, edges: list[tuple[Edge, Future[None]]]) -> None:
    if log.settings.credentials is None and log.settings.access == "full":  # an edge's user may do nothing but send
        await log.create_streams()
    sending = [asyncio.create_task(edge.send(log, taking)) for edge, taking in edges]
    try:
        await asyncio.gather(*sending)
    finally:
        for task in sending:
            task.cancel()
