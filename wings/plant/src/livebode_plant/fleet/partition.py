"""PartitionOwner: the endless task of a partition. It reads the log, tracks the axes, and stores results, then states.

The order of the writes is what makes results exactly-once; docs/fleet-design.md gives the reason for each step.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import socket
import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from livebode.configuration import Axis
from livebode.dataclass import dataclass
from livebode_plant.fleet.alike_axes import stacked_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.log import ClaimLostError, FleetLog
from livebode_plant.fleet.reader import Reader, StoredMessage
from livebode_plant.fleet.result_message import PendingResults, ResultMessage
from livebode_plant.fleet.server_config import PAYLOAD_BYTES_MAX
from livebode_plant.fleet.status_message import PageStatus
from livebode_plant.fleet.subjects import (
    LOG,
    LOG_STREAM,
    RESULT_STREAM,
    RESULTS,
    STATE_STREAM,
    STATES,
    STATUS,
    axis_path,
    key_of,
)

STATE_S_MIN = 2.0
"""Least time between two states of an axis."""
STATE_SHARE = 0.08
"""Most bytes of states, as a share of the bytes of the machines' data, while the replay is short enough."""
REPLAY_S_MAX = 3.0
"""Most computing time that a takeover of the partition repeats."""


@dataclass
class _Axis:
    """What came since the last state: bytes of the machine, and what it cost to compute."""

    size_bytes: int = 0
    since_bytes: int = 0
    since_s: float = 0.0
    stored_s: float = float("-inf")

    def rested(self, now_s: float) -> bool:
        return self.since_bytes > 0 and now_s - self.stored_s >= STATE_S_MIN


class StoredStates:
    """Decides by two rules. A takeover computes again what came since the last state of each axis.

    - A state is due when the data since then are so many times as large that states are `STATE_SHARE` of the bytes. A
      large state is stored less often.
    - If what a takeover would compute again takes longer than `REPLAY_S_MAX` for all axes together, those with most of
      it are due before that, whatever the size of their states.

    Parameters
    ----------
    clock
        Seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._axes: dict[str, _Axis] = {}

    @property
    def replay_s(self) -> float:
        """Computing time that a takeover would repeat now."""
        return sum(axis.since_s for axis in self._axes.values())

    def processed(self, key: str, size_bytes: int, computed_s: float) -> None:
        """A message of an axis was processed."""
        axis = self._axes.get(key)
        if axis is None:
            axis = self._axes[key] = _Axis()
        axis.since_bytes += size_bytes
        axis.since_s += computed_s

    def restored(self, key: str, size_bytes: int) -> None:
        """The axis continues from a state of this size."""
        self._axes[key] = _Axis(size_bytes)

    def stored(self, key: str, size_bytes: int) -> None:
        """The state of an axis was stored."""
        self._axes[key] = _Axis(size_bytes, stored_s=self._clock())

    def due(self) -> list[str]:
        """The axes whose state is to be stored now."""
        now_s = self._clock()
        rested = {key: axis for key, axis in self._axes.items() if axis.rested(now_s)}
        large = [key for key, axis in rested.items() if STATE_SHARE * axis.since_bytes >= axis.size_bytes]
        return large + list(self._too_long(rested, set(large)))

    def _too_long(self, rested: dict[str, _Axis], found: set[str]) -> Iterator[str]:
        left_s = self.replay_s - sum(rested[key].since_s for key in found)
        for key in sorted(rested.keys() - found, key=lambda key: rested[key].since_s, reverse=True):
            if left_s <= REPLAY_S_MAX:
                return
            left_s -= rested[key].since_s
            yield key


RESULTS_S = 0.4
"""Time between two messages of results. What arrives meanwhile is processed together."""
STATUS_S = 1.0
_READ_S = 0.1
_PENDING_BYTES_MAX = 1 << 20
_GOLDEN = 0.618
"""Multiples of it, without their whole part, are far from each other."""
_UNKNOWN_MAX = 100
"""Most axes that are not in the fleet and are reported."""

_logger = logging.getLogger(f"livebode.{__name__}")


class PartitionOwner:
    """Owns a partition until it is stopped, or until another process claims it.

    Parameters
    ----------
    log
        A connection of its own.
    number
        Of the partition.
    axes
        Configurations by key; those of other partitions have no effect.
    owner
        Name of this process in the results and in the status.
    """

    def __init__(self, log: FleetLog, number: int, axes: Mapping[str, Axis], owner: str = "") -> None:
        self._log, self._number, self._axes = log, number, axes
        self._owner = owner or f"{socket.gethostname()}:{os.getpid()}"
        self._streams: dict[str, AxisStream] = {}
        self._unknown: dict[str, int] = {}
        self._pending = PendingResults()
        self._result = 0
        self._through = 0
        self._stored = StoredStates()
        self._status_due_s = 0.0
        self._reported = 0
        self._since_s = time.time()
        self._newest_s = 0.0
        self._page = PageStatus(number, self._owner)

    async def run(self, stop: asyncio.Event) -> bool:
        """Own the partition; returns whether it was stopped (True) or another process has claimed it (False)."""
        try:
            await self._own(stop)
        except ClaimLostError:
            _logger.warning("partition %d was claimed by another process; this one stops", self._number)
            return False
        return True

    async def _own(self, stop: asyncio.Event) -> None:
        await self._claim()
        reader = Reader(self._log, LOG_STREAM, f"{LOG}.{self._number}.>", await self._restore())
        try:
            while not stop.is_set():
                await asyncio.sleep(0 if reader.pending else self._until_due_s())
                messages: Sequence[StoredMessage] = await reader.read(_READ_S if reader.pending else 0)
                while messages:
                    # Never in the loop of the connection, which must answer the server's pings in time.
                    messages = await asyncio.to_thread(self._process, messages)
                    if messages:
                        await self._store_results()
                await self._store(reader.pending)
            await self._store_results()
            await self._store_states(all_of_them=True)
        finally:
            await reader.close()

    async def _claim(self) -> None:
        """Write a claim after the newest result: whoever expects to write there now is refused from here on."""
        while True:
            last = await self._log.last(RESULT_STREAM, self._subject)
            self._result = 0 if last is None else last.number
            self._through = 0 if last is None else ResultMessage.from_bytes(last.data).through
            claim = ResultMessage(self._through, self._owner, claim=True)
            try:
                self._result = await self._append(claim)
            except ClaimLostError:
                continue  # the former owner has stored results meanwhile
            return

    async def _restore(self) -> int:
        """Restore every axis that the log has; returns the number of the first message that one of them needs."""
        extent = await self._log.extent(LOG_STREAM, f"{LOG}.{self._number}.>")
        subjects = sorted(extent.subjects)
        needed = await asyncio.gather(*(self._restore_axis(subject) for subject in subjects))
        # A state is stored after the results of all messages of the partition before it.
        self._through = max([self._through, *(stream.position for stream in self._streams.values())])
        # An axis may begin while the others are looked up: nothing after the extent is skipped.
        return min([extent.last + 1, *(first for first in needed if first is not None)])

    async def _restore_axis(self, subject: str) -> int | None:
        """Restore an axis; returns the number of the next message that it needs, if there is one already."""
        key = key_of(subject)
        state = await self._log.last(STATE_STREAM, self._state_subject(key))
        if state is None or key not in self._axes:
            return await self._log.following(LOG_STREAM, subject, 1)
        stream = AxisStream(self._axes[key], 0)
        try:
            stream.restore(state.data)
        except Exception as error:  # what its configuration has become may not be one that can be tracked
            return await self._begin_again(subject, error)
        self._streams[key] = stream
        self._stored.restored(key, len(state.data))
        return await self._log.following(LOG_STREAM, subject, stream.position + 1)

    async def _begin_again(self, subject: str, error: Exception) -> int | None:
        """An axis whose state cannot be restored begins a new run after what is stored, with an event that says why."""
        first = await self._log.following(LOG_STREAM, subject, self._through + 1)
        key = key_of(subject)
        if first is not None:
            self._streams[key] = AxisStream(self._axes[key], first)
            message = f"the state of {axis_path(key)} cannot be restored, so its tracking begins again: {error}"
            _logger.warning("%s", message)
            about = {"run": first, "kind": "state-rejected", "sample": 0, "time_s": 0.0, "message": message}
            self._pending.add_event(key, about | {"details": {}})
        return first

    def _process(self, messages: Sequence[StoredMessage]) -> Sequence[StoredMessage]:
        """Process messages until their results are enough for a message of results; returns the others."""
        stored = bisect_right(messages, self._through, key=lambda message: message.number)
        began_s = time.thread_time()
        sizes, taken = self._add_messages(messages[:stored] or messages)
        keys, streams = list(sizes), [self._streams[key] for key in sizes]
        stacks, outputs = stacked_together(streams)
        a_byte_s = (time.thread_time() - began_s) / max(1, sum(sizes.values()))
        for key, size in sizes.items():
            self._stored.processed(key, size, size * a_byte_s)
        if not stored:
            for stack in stacks:
                self._pending.add_rows([keys[i] for i in stack.indices], [streams[i] for i in stack.indices], stack)
            for i, output in outputs.items():
                self._pending.add(keys[i], streams[i], output)
        return messages[taken:]

    def _add_messages(self, messages: Sequence[StoredMessage]) -> tuple[dict[str, int], int]:
        """Hand messages to their axes until the results may be enough; returns their bytes by axis, and how many it
        took.

        Messages that arrived together are tracked together.
        """
        sizes: dict[str, int] = {}
        size = self._pending.nbytes
        for index, message in enumerate(messages):
            if size > _PENDING_BYTES_MAX:
                return sizes, index
            self._newest_s = message.stored_s
            key = key_of(message.subject)
            stream = self._stream(key, message.number)
            if stream is not None and message.number > stream.position:
                size += stream.add(message.data, message.number, message.stored_s)
                sizes[key] = sizes.get(key, 0) + len(message.data)
        return sizes, len(messages)

    def _stream(self, key: str, number: int) -> AxisStream | None:
        stream = self._streams.get(key)
        if stream is None and key in self._axes:
            stream = self._streams[key] = AxisStream(self._axes[key], number)
        if stream is None:
            if key not in self._unknown:
                if len(self._unknown) >= _UNKNOWN_MAX:
                    return None
                _logger.warning("the fleet has no axis %s, whose data arrive", axis_path(key))
            self._unknown[key] = self._unknown.get(key, 0) + 1
        return stream

    def _until_due_s(self) -> float:
        """Time until results are due. The partitions of a process take turns, so that they do not wait for another."""
        turn = self._number * _GOLDEN % 1
        return RESULTS_S * (1 - (time.monotonic() / RESULTS_S - turn) % 1)

    async def _store(self, waiting: int) -> None:
        await self._store_results()
        await self._store_states()
        if time.monotonic() >= self._status_due_s:
            self._status_due_s = time.monotonic() + STATUS_S
            if self._reported == self._result:
                await self._check_claim()
            self._reported = self._result
            await self._publish_status(waiting)

    async def _check_claim(self) -> None:
        """Without data nothing is stored, and so nothing else shows that another process has claimed the partition."""
        last = await self._log.last(RESULT_STREAM, self._subject)
        if last is not None and last.number > self._result:
            raise ClaimLostError(self._subject)

    async def _store_results(self) -> None:
        if self._pending:
            through = max(self._through, *(stream.position for stream in self._streams.values()))
            self._result = await self._append(self._pending.message(through, self._owner))
            self._through, self._pending = through, PendingResults()

    async def _store_states(self, *, all_of_them: bool = False) -> None:
        """Store states that are due. Nothing is pending, so the results that they depend on are stored."""
        for key in list(self._streams) if all_of_them else self._stored.due():
            state = await asyncio.to_thread(self._streams[key].snapshot)
            if len(state) <= PAYLOAD_BYTES_MAX:
                await self._log.append(self._state_subject(key), state)
            else:  # an older one remains, and a takeover computes more again
                _logger.warning("the state of %s is too large for the log: %d bytes", axis_path(key), len(state))
            self._stored.stored(key, len(state))

    async def _append(self, message: ResultMessage) -> int:
        return await self._log.append_after(RESULT_STREAM, self._subject, message.to_bytes(), self._result)

    @property
    def _subject(self) -> str:
        return f"{RESULTS}.{self._number}"

    def _state_subject(self, key: str) -> str:
        return f"{STATES}.{self._number}.{key}"

    async def _publish_status(self, waiting: int) -> None:
        lag_s = max(0.0, time.time() - (self._newest_s or self._since_s)) if waiting else 0.0
        for subject, message in self._page.messages(self._streams, time.time(), waiting, lag_s):
            await self._log.publish(subject, message)
        about = {
            "partition": self._number,
            "owner": self._owner,
            "since_s": self._since_s,
            "at_s": time.time(),
            "through": self._through,
            "waiting": waiting,
            "lag_s": lag_s,
            "unknown": self._unknown,
            "axes": {key: _axis_status(stream) for key, stream in self._streams.items()},
        }
        await self._log.append(f"{STATUS}.{self._number}", json.dumps(about).encode())


def _axis_status(stream: AxisStream) -> dict[str, Any]:
    counts = {"responses": stream.responses, "lost": stream.lost, "position": stream.position}
    return counts | {"failure": stream.failure, "log_s": stream.log_s}
