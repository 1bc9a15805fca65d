"""Edge: the batches of a live source, through a buffer on disk, into the log."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from livebode.fleet.edge_buffer import EdgeBuffer
from livebode.fleet.log import FleetLog
from livebode.fleet.message import message_id, write_message
from livebode.fleet.settings import FleetSettings, LogSection
from livebode.fleet.subjects import EDGE
from livebode.sources.live import Batch, LiveBlock, LiveSource, SpectraBatch
from livebode.sources.live.spectra_batch import AnyBatch, LiveSpectra

_IDLE_S = 0.05
_REST_S = 1.0
_logger = logging.getLogger(__name__)


class Edge:
    """Sends the messages of a buffer to the log, in order, each until the log has stored it.

    Parameters
    ----------
    key
        Of the axis.
    buffer
        To which the batches are appended.
    message_bytes_max
        Size of the largest message that the log accepts; a larger one is dropped.
    """

    def __init__(self, key: str, buffer: EdgeBuffer, message_bytes_max: int = LogSection().message_bytes_max) -> None:
        self._key, self._buffer, self._message_bytes_max = key, buffer, message_bytes_max
        self._dropped = buffer.dropped
        self.sent = 0
        """Messages that the log has stored."""

    def take(self, batch: AnyBatch) -> None:
        """Append a batch to the buffer; may be called from any thread."""
        message = write_message(batch)
        if len(message) > self._message_bytes_max:
            _logger.warning(
                "a message of %d kB was dropped: log.message_kb is %g; send shorter blocks",
                len(message) / 1e3, self._message_bytes_max / 1e3,
            )  # fmt: skip
            return
        self._buffer.append(message)
        if self._buffer.dropped > self._dropped:
            lost, self._dropped = self._buffer.dropped - self._dropped, self._buffer.dropped
            _logger.warning("the buffer is full: the oldest %d messages were deleted", lost)

    async def send(self, log: FleetLog, taking: Future[None]) -> None:
        """Send until the thread that fills the buffer has ended, and the buffer is empty."""
        while True:
            over = taking.done()
            message = self._buffer.first()
            if message is not None:
                await log.append(f"{EDGE}.{self._key}", message, message_id(self._key, message))
                self._buffer.remove(message)
                self.sent += 1
            elif over:
                return
            else:
                await asyncio.sleep(_IDLE_S)


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


def send_sources(settings: FleetSettings, sources: Mapping[str, LiveSource], stop: threading.Event) -> int:
    """Send the batches of open sources until they end, or until `stop` is set and a second has passed.

    What the log has not stored by then remains in the buffer, and is sent at the next start. Returns the number of
    messages that were stored.

    Parameters
    ----------
    settings
        Of the fleet.
    sources
        By the key of their axis.

    Raises
    ------
    FleetError
        If the log cannot be reached at the start, or a buffer cannot be used.
    SourceError
        If a source fails.
    """
    bytes_max = round(settings.edge.buffer_gb * 1e9 / max(1, len(sources)))
    buffers = {key: EdgeBuffer(settings.edge.buffer / key, bytes_max) for key in sources}
    edges = {key: Edge(key, buffer, settings.log.message_bytes_max) for key, buffer in buffers.items()}
    with ThreadPoolExecutor(max(1, len(sources)), "livebode source") as threads:
        taking = [threads.submit(_take_all, source, edges[key]) for key, source in sources.items()]
        try:
            asyncio.run(send_edges(settings.log, list(zip(edges.values(), taking)), stop))
        finally:
            for source in sources.values():
                source.stop()
    for buffer in buffers.values():
        buffer.close()
    for one in taking:
        one.result()
    return sum(edge.sent for edge in edges.values())


def _take_all(source: LiveSource, edge: Edge) -> None:
    for batch in sender_batches(source):
        edge.take(batch)


async def send_edges(settings: LogSection, edges: list[tuple[Edge, Future[None]]], stop: threading.Event) -> None:
    """Send the messages of each edge until the thread that fills it has ended, or a second after `stop`."""
    async with FleetLog(settings, "livebode send") as log:
        if settings.credentials is None:  # a user of an edge may do nothing but send
            await log.create_streams()
        sending = asyncio.gather(*(edge.send(log, taking) for edge, taking in edges))
        while not sending.done() and not stop.is_set():
            await asyncio.sleep(_IDLE_S)
        await asyncio.wait([sending], timeout=_REST_S)
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
