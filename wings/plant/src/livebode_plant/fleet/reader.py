"""Reader: messages of a stream from a number on, in order and without a gap, whatever happens to the connection."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any, NamedTuple

from livebode.dataclass import dataclass
from livebode_plant.fleet.server_config import PAYLOAD_BYTES_MAX

if TYPE_CHECKING:
    from nats.aio.client import Client
    from nats.aio.msg import Msg

    from livebode_plant.fleet.log import FleetLog

MESSAGES_MAX = 1024
_BYTES_MAX = 2 * PAYLOAD_BYTES_MAX
"""More than any message, or the server would never deliver it."""
_REQUEST = json.dumps({"batch": MESSAGES_MAX, "max_bytes": _BYTES_MAX, "no_wait": True}).encode()
_ANSWER_S, _LOOK_S = 2.0, 0.25
_ENDS = {"404", "408", "409 Message Size Exceeds MaxBytes"}
"""Status of a request that is answered: nothing more is there, or no more fits."""
_ACK = "$JS.ACK."


class Delivery(NamedTuple):
    """What the server says of a message in the address for its acknowledgement.

    Attributes
    ----------
    number
        In the stream.
    delivered
        Number of the delivery by this consumer, from 1.
    stored_s
        When the server received the message, seconds since 1970.
    pending
        Messages that the consumer has beyond this one.
    """

    number: int
    delivered: int
    stored_s: float
    pending: int

    @classmethod
    def of(cls, reply: str) -> Delivery:
        """A delivery from "$JS.ACK.", stream, consumer, times delivered, and these four.

        Servers put their domain and account before the stream, and may put more at the end.

        >>> Delivery.of("$JS.ACK.LOG.name.1.7.3.1700000000500000000.2")
        Delivery(number=7, delivered=3, stored_s=1700000000.5, pending=2)
        """
        tokens = reply.split(".")
        first = 5 if len(tokens) == 9 else 7
        number, delivered, stored_ns, pending = map(int, tokens[first : first + 4])
        return cls(number, delivered, stored_ns / 1e9, pending)


class ConsumerLostError(Exception):
    """The server no longer has the consumer, or may have delivered something that did not arrive."""


class Consumer:
    """Asks the server for what it has, and collects the answer.

    nats-py's own `fetch` asks and waits for each message with a task and a timer, which costs more than the message.
    A request whose answer comes in one piece costs little more with a thousand messages than with one. There is never
    more than one at the server, which bounds the memory.

    Parameters
    ----------
    connection
        To the server.
    request_subject
        To which the requests to the server's consumer are sent.
    """

    def __init__(self, connection: Client, request_subject: str) -> None:
        self._connection, self._request_subject = connection, request_subject
        self._inbox = connection.new_inbox()
        self._connected = connection.stats["reconnects"]
        self._subscription: Any = None
        self._missing = 0
        self._arrived: list[Msg] = []
        self._end = ""
        self._ended = asyncio.Event()

    async def open(self) -> None:
        """Begin to receive."""
        self._subscription = await self._connection.subscribe(self._inbox, cb=self._receive)

    async def close(self) -> None:
        """End receiving. The server removes a consumer that nobody asks."""
        await self._subscription.unsubscribe()

    async def ask(self) -> None:
        """Send a request, if none is sent."""
        if not self._missing:
            self._missing = MESSAGES_MAX
            self._end = ""
            self._ended.clear()
            await self._connection.publish(self._request_subject, _REQUEST, reply=self._inbox)

    async def answer(self) -> list[Msg]:
        """What the server had when it received the request, at most `MESSAGES_MAX` messages.

        Raises
        ------
        ConsumerLostError
            If the server does not answer, or no longer has the consumer.
        """
        until_s = time.monotonic() + _ANSWER_S
        while not self._ended.is_set() and time.monotonic() < until_s and self._unbroken:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ended.wait(), _LOOK_S)
        if self._end not in _ENDS or not self._unbroken:
            raise ConsumerLostError(self._end)
        found, self._arrived, self._missing = self._arrived, [], 0
        return found

    @property
    def _unbroken(self) -> bool:
        return self._connection.stats["reconnects"] == self._connected

    async def _receive(self, message: Msg) -> None:
        if message.reply.startswith(_ACK):
            self._arrived.append(message)
            self._missing -= 1
            if self._missing:
                return
            self._end = "404"
        else:
            status = message.headers or {}
            self._end = status.get("Status", "")
            if self._end == "409":
                self._end += " " + status.get("Description", "")
        self._ended.set()


_logger = logging.getLogger(f"livebode.{__name__}")
_INACTIVE_S = 60.0
_READ_S = 0.2


@dataclass(frozen=True)
class StoredMessage:
    """A message of a stream: its number there, its data, and when the server received it, seconds since 1970."""

    subject: str
    number: int
    data: bytes
    write: str
    stored_s: float


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
