"""Reader: messages of a stream from a number on, in order and without a gap, whatever happens to the connection."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any

from livebode.fleet.log import FleetLog, StoredMessage

if TYPE_CHECKING:
    from nats.aio.msg import Msg

_logger = logging.getLogger(__name__)
_BATCH = 64
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
        self.pending = 1
        """Messages that the server had beyond the last one returned; at least one while the server was not asked."""
        self._subscription: Any = None
        self._delivered = 0
        self._heard_s = 0.0

    async def read(self, timeout_s: float) -> list[StoredMessage]:
        """The next messages; none if none come in time."""
        try:
            if self._subscription is None:
                await self._subscribe()
            found: list[Msg] = await self._subscription.fetch(_BATCH, timeout=timeout_s)
        except (TimeoutError, self._log.errors) as error:
            await self._doubt(error, timeout_s)
            return []
        self._heard_s = time.monotonic()
        return await self._checked(found)

    async def close(self) -> None:
        """Remove the consumer."""
        subscription, self._subscription = self._subscription, None
        if subscription is not None:
            with contextlib.suppress(self._log.errors, asyncio.TimeoutError):
                await subscription.unsubscribe()

    async def _subscribe(self) -> None:
        self._subscription = await self._log.subscription(self._stream, self._subject, self.next, _INACTIVE_S)
        self._delivered, self._heard_s = 0, time.monotonic()
        self.pending = (await self._subscription.consumer_info()).num_pending

    async def _checked(self, found: list[Msg]) -> list[StoredMessage]:
        messages = []
        for message in found:
            about = message.metadata
            if about.sequence.consumer != self._delivered + 1:
                _logger.warning("%s: messages were lost on the way; reading again from %d", self._subject, self.next)
                await self.close()
                break
            self._delivered += 1
            self.pending = about.num_pending
            stored_s = about.timestamp.timestamp()
            messages.append(StoredMessage(message.subject, about.sequence.stream, message.data, "", stored_s))
            self.next = about.sequence.stream + 1
        return messages

    async def _doubt(self, error: Exception, timeout_s: float) -> None:
        """After a silence, find out whether there is nothing to read or nothing to read it with."""
        if self._subscription is None:
            await asyncio.sleep(timeout_s)
        elif time.monotonic() - self._heard_s > _DOUBT_S or not isinstance(error, asyncio.TimeoutError):
            try:
                waiting = (await self._subscription.consumer_info()).num_pending
                self._heard_s = time.monotonic()
                if waiting:
                    await self.close()
            except (TimeoutError, self._log.errors):
                await self.close()
                self.pending = max(1, self.pending)


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
