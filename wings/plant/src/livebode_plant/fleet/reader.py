"""Reader: messages of a stream from a number on, in order and without a gap, whatever happens to the connection."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from livebode_plant.fleet.consumer import Consumer, ConsumerLostError, Delivery
from livebode_plant.fleet.log import FleetLog, StoredMessage

if TYPE_CHECKING:
    from nats.aio.msg import Msg

_logger = logging.getLogger(f"livebode.{__name__}")
_INACTIVE_S = 60.0
_READ_S = 0.2


class Reader:
    """Pulls the messages of a subject, without acknowledgements: what was read is a matter of the reader's results.

    The server numbers what it delivers to a consumer. A number that does not follow the previous one means that
    messages were lost on the way; the reader then begins again after the last message that it returned.

    Parameters
    ----------
    log
        The connection.
    stream, subject
        What is read.
    first
        Number in the stream of the first message, or of one before it.
    """

    def __init__(self, log: FleetLog, stream: str, subject: str, first: int) -> None:
        self._log, self._stream, self._subject = log, stream, subject
        self.next = first
        """Number after the last message that was returned."""
        self.pending = 1
        """Messages that the server had beyond the last one returned; at least one while the server was not asked."""
        self._consumer: Consumer | None = None
        self._delivered = 0

    async def read(self, timeout_s: float) -> list[StoredMessage]:
        """The next messages; if there are none, nothing after `timeout_s`."""
        try:
            if self._consumer is None:
                self._consumer = await self._log.consumer(self._stream, self._subject, self.next, _INACTIVE_S)
                self._delivered = 0
            await self._consumer.ask()
            messages = await self._checked(await self._consumer.answer())
            if self.pending and self._consumer is not None:
                await self._consumer.ask()  # the server answers while these are processed
        except (TimeoutError, ConsumerLostError, self._log.errors):
            await self.close()
            await asyncio.sleep(max(timeout_s, _READ_S))
            return []
        if not messages:
            await asyncio.sleep(timeout_s)
        return messages

    async def close(self) -> None:
        """End reading."""
        consumer, self._consumer = self._consumer, None
        self.pending = max(1, self.pending)
        if consumer is not None:
            with contextlib.suppress(self._log.errors, asyncio.TimeoutError):
                await consumer.close()

    async def _checked(self, found: list[Msg]) -> list[StoredMessage]:
        messages: list[StoredMessage] = []
        self.pending = 0
        for message in found:
            about = Delivery.of(message.reply)
            if about.delivered != self._delivered + 1:
                _logger.warning("%s: messages were lost on the way; reading again from %d", self._subject, self.next)
                await self.close()
                break
            self._delivered += 1
            messages.append(StoredMessage(message.subject, about.number, message.data, "", about.stored_s))
            self.next, self.pending = about.number + 1, about.pending
        return messages


async def stored_messages(
    log: FleetLog, stream: str, subject: str, through: int, first: int = 1
) -> AsyncIterator[StoredMessage]:
    """The messages of a subject from number `first` to `through`, which are in the stream already."""
    # nats-server 2.9.10 can end at the request for the newest message of several subjects that have none.
    last = await log.last(stream, subject) if (await log.extent(stream, subject)).subjects else None
    reader = Reader(log, stream, subject, first)
    try:
        while last is not None and reader.next <= min(through, last.number):
            for message in await reader.read(_READ_S):
                if message.number <= through:
                    yield message
    finally:
        await reader.close()
