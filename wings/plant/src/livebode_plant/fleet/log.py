"""FleetLog: the connection to NATS JetStream. Everything that is stored, is stored here."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
import time
import uuid
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from livebode.core import FleetError
from livebode.dataclass import dataclass
from livebode_plant.fleet import subjects
from livebode_plant.fleet.connection import connected
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.reader import Consumer, StoredMessage
from livebode_plant.fleet.subjects import LOG_STREAM

_WORD = "partitions"


def description_of(count: int) -> str:
    """The description of the stream.

    >>> partitions_of(description_of(16))
    16
    """
    return f"livebode, {count} {_WORD}"


def partitions_of(description: str | None) -> int | None:
    """The number in a description; None if it has none."""
    words = (description or "").split()
    return int(words[-2]) if words[-1:] == [_WORD] and words[-2].isdecimal() else None


def partitions_changed(before: int, count: int) -> FleetError:
    """The error for a number that differs from that of the data in the log."""
    return FleetError(
        "partitions-changed",
        f"the log has data in {before} partitions, and the fleet has partitions = {count}: an axis would continue in "
        "another partition, without its state and beside its former owner",
        f"set partitions = {before}, or begin with an empty log",
        before=before,
        partitions=count,
    )


def check_store(store: Path, count: int) -> None:
    """FleetError if the store of a server on this computer has data in another number of partitions."""
    for about in store.glob(f"jetstream/*/streams/{LOG_STREAM}/meta.inf"):
        before = partitions_of(json.loads(about.read_text()).get("description"))
        filled = any(block.stat().st_size for block in about.parent.glob("msgs/*.blk"))
        if before is not None and before != count and filled:
            raise partitions_changed(before, count)


_logger = logging.getLogger(f"livebode.{__name__}")
_EXPECTED, _IDENTITY, _WRITE = "Nats-Expected-Last-Subject-Sequence", "Nats-Msg-Id", "Livebode-Write"
_WRONG_LAST_SEQUENCE, _LAST = 10071, re.compile(r"\d+$")
_LIMITS = ("max_bytes", "max_age", "max_msgs_per_subject", "num_replicas")
_REQUEST_S, _RETRY_S, _RETRY_S_MAX = 2.0, 0.1, 1.0
_DUPLICATES_S = 120.0
T = TypeVar("T")


class ClaimLostError(Exception):
    """Another owner has claimed the partition: its last message is not the one that this owner expects."""


class OtherLastError(Exception):
    """The last message of a subject is not the expected one.

    Attributes
    ----------
    last
        Its number; 0 if there is none.
    repeated
        Whether an attempt before was not answered, so that the last message may be the one to be stored.
    """

    def __init__(self, last: int, repeated: bool) -> None:
        super().__init__(last)
        self.last, self.repeated = last, repeated


@dataclass(frozen=True)
class StreamExtent:
    """Numbers of the first and the last message of a stream, its size, and its messages by subject.

    When it was created distinguishes it from another one with the same numbers, seconds since 1970.
    """

    first: int
    last: int
    size_bytes: int
    subjects: Mapping[str, int]
    created_s: float


class FleetLog:
    """A connection to the server of the log. Each request is repeated until the server answers.

    Use it as an asynchronous context manager.

    Parameters
    ----------
    settings
        Address and limits.
    name
        Of this connection, as the server lists it.
    """

    def __init__(self, settings: LogSection, name: str) -> None:
        self.settings, self._name = settings, name
        self.trouble = ""
        """Why the server does not answer at the moment; empty while it does."""

    async def __aenter__(self) -> FleetLog:
        """Connect.

        Raises
        ------
        ConfigError, FleetError, ExtraError
            As `connected`.
        """
        self._connection = await connected(self.settings, self._name, self._report)
        import nats

        self._nats = nats
        self.errors: type[Exception] = nats.errors.Error
        self._api = subjects.VIEW_API if self.settings.access == "view" else subjects.API
        self._js = self._connection.jetstream(timeout=_REQUEST_S, prefix=self._api)
        return self

    async def __aexit__(self, *_: object) -> None:
        with contextlib.suppress(self._nats.errors.Error, asyncio.TimeoutError):
            await self._connection.close()

    async def create_streams(self, *, update: bool = False) -> None:
        """Create the streams of a fleet where they are missing; `update`: give existing ones the limits of today."""
        from nats.js import api

        each = self.settings.replicas
        common: dict[str, Any] = {"storage": api.StorageType.FILE, "num_replicas": each}
        newest: dict[str, Any] = {"max_msgs_per_subject": 1, **common}
        streams = [
            api.StreamConfig(
                name=subjects.LOG_STREAM,
                subjects=[f"{subjects.LOG}.>"],
                max_bytes=round(self.settings.size_gb * 1e9),
                max_age=self.settings.age_days * 86400,
                max_msgs_per_subject=self.settings.axis_messages,
                duplicate_window=_DUPLICATES_S,
                **common,
            ),
            api.StreamConfig(
                name=subjects.RESULT_STREAM,
                subjects=[f"{subjects.RESULTS}.*"],
                max_bytes=round(self.settings.results_gb * 1e9),
                **common,
            ),
            api.StreamConfig(name=subjects.STATE_STREAM, subjects=[f"{subjects.STATES}.>"], **newest),
            api.StreamConfig(name=subjects.STATUS_STREAM, subjects=[f"{subjects.STATUS}.*"], **newest),
        ]
        for stream in streams:
            await self._create(stream, update)

    async def _create(self, stream: Any, update: bool) -> None:
        from nats.js.errors import NotFoundError

        async def create() -> None:
            try:
                config = (await self._js.stream_info(stream.name)).config
            except NotFoundError:
                await self._js.add_stream(stream)
                return
            limits = {name: getattr(stream, name) for name in _LIMITS if getattr(stream, name) is not None}
            if update and any(getattr(config, name) != value for name, value in limits.items()):
                await self._js.update_stream(config.evolve(**limits))

        await self._repeated(create)

    async def use_partitions(self, count: int) -> None:
        """Record in the log how many partitions the fleet has.

        Raises
        ------
        FleetError
            If the log has data in another number of partitions.
        """
        info = await self._repeated(lambda: self._js.stream_info(subjects.LOG_STREAM))
        before = partitions_of(info.config.description)
        if before is not None and before != count and info.state.messages:
            raise partitions_changed(before, count)
        if before != count:
            config = info.config.evolve(description=description_of(count))
            await self._repeated(lambda: self._js.update_stream(config))

    async def append(self, subject: str, data: bytes, identity: str | None = None, after: int | None = None) -> int:
        """Store a message, and return its number; one with the `identity` of a recent one is stored only once.

        Raises
        ------
        OtherLastError
            If `after` is not the number of the last message of the subject.
        """
        headers = {_IDENTITY: identity} if identity else {}
        if after is not None:
            headers[_EXPECTED] = str(after)
        attempts = 0

        async def store() -> int:
            nonlocal attempts
            attempts += 1
            try:
                ack = await self._js.publish(subject, data, headers=headers or None, timeout=_REQUEST_S)
            except self._nats.js.errors.APIError as error:
                if error.err_code == _WRONG_LAST_SEQUENCE and (number := _LAST.search(error.description or "")):
                    raise OtherLastError(int(number[0]), attempts > 1) from None
                raise
            return int(ack.seq)

        return await self._repeated(store)

    async def publish(self, subject: str, data: bytes) -> None:
        """Send a message that is not stored; while the server does not answer, it is dropped."""
        with contextlib.suppress(self._nats.errors.Error):
            await self._connection.publish(subject, data)

    async def append_after(self, stream: str, subject: str, data: bytes, after: int) -> int:
        """Store a message if `after` is still the number of the last one of its subject; returns its number.

        This is the fence: of two processes that both own a partition, one is refused. A write whose outcome is not
        known, because the server did not answer, is looked up, and repeated only if it did not arrive.

        Servers in a cluster compare `after` before they agree on the order of two writes, so both can pass
        (https://github.com/nats-io/nats-server/issues/4320). Therefore `after` is the identity of the write too: of two
        with the same one, which are compared when they are stored, the second is dropped as a repeat.

        Raises
        ------
        ClaimLostError
            If another process has stored a message there.
        """
        write = uuid.uuid4().hex
        headers = {_EXPECTED: str(after), _WRITE: write, _IDENTITY: f"{subject}:{after}"}
        pause_s = _RETRY_S
        while True:
            try:
                ack = await self._js.publish(subject, data, headers=headers, timeout=_REQUEST_S)
                if not ack.duplicate:
                    return int(ack.seq)
            except (TimeoutError, self._nats.errors.Error) as error:
                if getattr(error, "err_code", None) != _WRONG_LAST_SEQUENCE:
                    self._report(error)
            last = await self.last(stream, subject)
            if last is not None and last.write == write:
                return last.number
            if (0 if last is None else last.number) != after:
                raise ClaimLostError(subject)
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, _RETRY_S_MAX)

    async def last(self, stream: str, subject: str) -> StoredMessage | None:
        """The newest message of a subject."""
        from nats.js.errors import NotFoundError

        async def get() -> StoredMessage | None:
            try:
                return _stored(await self._js.get_last_msg(stream, subject))
            except NotFoundError:
                return None

        return await self._repeated(get)

    async def following(self, stream: str, subject: str, number: int) -> int | None:
        """Number of the first message of a subject that is at least `number`."""
        message = await self._next(stream, subject, number)
        return None if message is None else message.number

    async def first_since(self, stream: str, subject: str, at_s: float) -> int:
        """Number from which on the messages of a subject were stored at this time or later, seconds since 1970."""
        extent = await self.extent(stream)
        low, high = extent.first, extent.last + 1
        while low < high:  # between them is the first one
            middle = (low + high) // 2
            message = await self._next(stream, subject, middle)
            if message is None or message.stored_s >= at_s:
                high = middle
            else:
                low = message.number + 1
        return low

    async def _next(self, stream: str, subject: str, number: int) -> StoredMessage | None:
        from nats.js.errors import NotFoundError

        async def get() -> StoredMessage | None:
            try:
                return _stored(await self._js.get_msg(stream, number, subject=subject, next=True))
            except NotFoundError:
                return None

        return await self._repeated(get)

    async def extent(self, stream: str, subject: str = ">") -> StreamExtent:
        """First and last number, size, and the subjects that match."""
        info = await self._repeated(lambda: self._js.stream_info(stream, subjects_filter=subject))
        assert info.created is not None
        state, created_s = info.state, info.created.timestamp()
        return StreamExtent(state.first_seq, state.last_seq, state.bytes, state.subjects or {}, created_s)

    async def consumer(self, stream: str, subject: str, first: int, inactive_s: float) -> Consumer:
        """A consumer of a subject from a number on, without acknowledgements, in the memory of the server."""
        from nats.js import api

        name = uuid.uuid4().hex
        config = api.ConsumerConfig(
            name=name,
            filter_subject=subject,
            ack_policy=api.AckPolicy.NONE,
            deliver_policy=api.DeliverPolicy.BY_START_SEQUENCE,
            opt_start_seq=max(1, first),
            inactive_threshold=inactive_s,
            mem_storage=True,
        )
        await self._js.add_consumer(stream, config)
        consumer = Consumer(self._connection, f"{self._api}.CONSUMER.MSG.NEXT.{stream}.{name}")
        await consumer.open()
        return consumer

    async def _repeated(self, request: Callable[[], Awaitable[T]]) -> T:
        pause_s = _RETRY_S
        while True:
            try:
                result = await request()
            except (TimeoutError, self._nats.errors.Error) as error:
                if self._connection.is_closed:  # the server ended it with a reason for which nats-py does not return
                    raise FleetError(
                        "log-unreachable",
                        f"the log at {self.settings.url} has ended the connection ({error})",
                        "look into the log of nats-server for the reason",
                        url=self.settings.url,
                    ) from None
                self._report(error)
            else:
                self.trouble = ""
                return result
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, _RETRY_S_MAX)

    def _report(self, error: Exception) -> None:
        from nats.js.errors import NoStreamResponseError

        reason = str(error) or type(error).__name__
        if isinstance(error, NoStreamResponseError):
            reason = "nothing there takes this message: start `livebode fleet run`, and check that the key may send it"
        if not self.trouble:
            _logger.warning("the log does not answer (%s); retrying", reason)
        self.trouble = reason


def with_log(settings: LogSection, name: str, ask: Callable[[FleetLog], Awaitable[T]]) -> T:
    """The result of `ask`, which receives a connection of this name; errors as of `FleetLog`."""

    async def connected() -> T:
        async with FleetLog(settings, name) as log:
            return await ask(log)

    return asyncio.run(connected())


def _stored(raw: Any) -> StoredMessage:
    headers = raw.headers or {}
    stored_s = raw.time.timestamp() if raw.time is not None else time.time()
    return StoredMessage(raw.subject, raw.seq, raw.data or b"", headers.get(_WRITE, ""), stored_s)
