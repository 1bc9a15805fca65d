"""Reader: messages of a stream from a number on, in order and without a gap, whatever happens to the connection."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from livebode.fleet.consumer import Consumer, Delivery
from livebode.fleet.log import FleetLog, StoredMessage

if TYPE_CHECKING:
    from nats.aio.msg import Msg

_logger = logging.getLogger(__name__)
_INACTIVE_S = 60.0
_READ_S = 0.2
_DOUBT_S = 1.0
"""Silence after which the server is asked whether it still has the consumer."""


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
        self.pending = 0
        """Messages that the server had beyond the last one returned."""
        self._consumer: Consumer | None = None
        self._delivered = 0
        self._heard_s = 0.0

    async def read(self, timeout_s: float) -> list[StoredMessage]:
        """The next messages, all that have arrived; if none have, wait at most `timeout_s` for them."""
        try:
            if self._consumer is None:
                await self._subscribe()
            assert self._consumer is not None
            found = await self._consumer.take(timeout_s)
            if not found and time.monotonic() - self._heard_s > _DOUBT_S:
                await self._doubt(self._consumer)
        except (TimeoutError, self._log.errors):
            await self.close()
            await asyncio.sleep(max(timeout_s, _READ_S))
            return []
        return await self._checked(found)

    async def close(self) -> None:
        """End reading."""
        consumer, self._consumer = self._consumer, None
        if consumer is not None:
            with contextlib.suppress(self._log.errors, asyncio.TimeoutError):
                await consumer.close()

    async def _subscribe(self) -> None:
        self._consumer = await self._log.consumer(self._stream, self._subject, self.next, _INACTIVE_S)
        self._delivered, self._heard_s = 0, time.monotonic()
        self.pending, _ = await self._consumer.state()

    async def _checked(self, found: list[Msg]) -> list[StoredMessage]:
        messages = []
        for message in found:
            about = Delivery.of(message.reply)
            if about.delivered != self._delivered + 1:
                _logger.warning("%s: messages were lost on the way; reading again from %d", self._subject, self.next)
                await self.close()
                break
            self._delivered += 1
            messages.append(StoredMessage(message.subject, about.number, message.data, "", about.stored_s))
            self.next, self.pending = about.number + 1, about.pending
        if messages:
            self._heard_s = time.monotonic()
        return messages

    async def _doubt(self, consumer: Consumer) -> None:
        """After a silence, find out whether there is nothing to read or nothing to read it with."""
        pending, requests = await consumer.state()
        self._heard_s = time.monotonic()
        if pending:
            await self.close()
        elif not requests:
            consumer.ask_again()


async def stored_messages(
    log: FleetLog, stream: str, subject: str, through: int, first: int = 1
) -> AsyncIterator[StoredMessage]:
    """The messages of a subject from number `first` to `through`, which are in the stream already."""
    last = await log.last(stream, subject)
    reader = Reader(log, stream, subject, first)
    try:
        while last is not None and reader.next <= min(through, last.number):
            for message in await reader.read(_READ_S):
                if message.number <= through:
                    yield message
    finally:
        await reader.close()
