"""Consumer: what the server delivers of a stream, collected as it comes.

nats-py's own `fetch` asks and waits for each message with a task and a timer, which costs more than the message.
"""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any, NamedTuple

from livebode.fleet.server_config import PAYLOAD_BYTES_MAX

if TYPE_CHECKING:
    from nats.aio.client import Client
    from nats.aio.msg import Msg
    from nats.js import JetStreamContext

MESSAGES_MAX = 1024
_BYTES_MAX = 2 * PAYLOAD_BYTES_MAX
"""More than any message, or the server would never deliver it."""
_EXPIRES_S = 30.0
_REQUEST = json.dumps({"batch": MESSAGES_MAX, "max_bytes": _BYTES_MAX, "expires": round(_EXPIRES_S * 1e9)}).encode()
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
        """From "$JS.ACK.", stream, consumer, times delivered, and these four; servers put their domain and account
        before the stream, and may put more at the end.

        >>> Delivery.of("$JS.ACK.LOG.name.1.7.3.1700000000500000000.2")
        Delivery(number=7, delivered=3, stored_s=1700000000.5, pending=2)
        """
        tokens = reply.split(".")
        first = 5 if len(tokens) == 9 else 7
        number, delivered, stored_ns, pending = map(int, tokens[first : first + 4])
        return cls(number, delivered, stored_ns / 1e9, pending)


class Consumer:
    """Asks the server for messages, some hundreds at a time, and collects what comes.

    There is never more than one request at the server, and the next one is sent when the messages of the last one are
    taken: this bounds the memory.

    Parameters
    ----------
    connection, streams
        Of the log.
    stream, name
        Of the consumer at the server.
    request_subject
        To which its requests are sent.
    """

    def __init__(
        self, connection: Client, streams: JetStreamContext, stream: str, name: str, request_subject: str
    ) -> None:
        self._connection, self._streams = connection, streams
        self._stream, self._name, self._request_subject = stream, name, request_subject
        self._inbox = connection.new_inbox()
        self._subscription: Any = None
        self._due = 0
        self._arrived: list[Msg] = []
        self._news = asyncio.Event()

    async def open(self) -> None:
        """Begin to receive."""
        self._subscription = await self._connection.subscribe(self._inbox, cb=self._receive)

    async def close(self) -> None:
        """End receiving. The server removes a consumer that nobody asks."""
        await self._subscription.unsubscribe()

    async def take(self, timeout_s: float) -> list[Msg]:
        """What has arrived since the last call; if nothing has, wait at most `timeout_s` for it."""
        await self._ask()
        if not self._arrived and timeout_s > 0:
            try:
                await asyncio.wait_for(self._news.wait(), timeout_s)
            except TimeoutError:
                return []
        found, self._arrived = self._arrived, []
        self._news.clear()
        await self._ask()
        return found

    async def state(self) -> tuple[int, int]:
        """Number of messages that the server has for it, and of its requests there.

        Raises
        ------
        nats.errors.Error, TimeoutError
            If it no longer exists, or the server does not answer.
        """
        info = await self._streams.consumer_info(self._stream, self._name)
        return info.num_pending or 0, info.num_waiting or 0

    def ask_again(self) -> None:
        """The request was lost: the next `take` sends another one."""
        self._due = 0

    async def _ask(self) -> None:
        if self._due <= 0:
            self._due = MESSAGES_MAX
            await self._connection.publish(self._request_subject, _REQUEST, reply=self._inbox)

    async def _receive(self, message: Msg) -> None:
        if message.reply.startswith(_ACK):
            self._due -= 1
            self._arrived.append(message)
            self._news.set()
        else:
            self._due = 0  # the end of the request: its time or its bytes are used up, or there is no such consumer
