"""LiveSource: the common part of all live sources. A new one implements `_receive`."""

from __future__ import annotations

import logging
import socket
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import inf, isnan
from typing import ClassVar, Self

from livebode.core import Channel, Event, LivebodeError, SourceError, SpectraLayout, nearest_name
from livebode.language import Message
from livebode.sources.live.address import Address
from livebode.sources.live.backlog_cause import BacklogCause
from livebode.sources.live.batch import LiveBlock
from livebode.sources.live.computer_clock import ClockReading, pause
from livebode.sources.live.dropped import Dropped
from livebode.sources.live.health import Health
from livebode.sources.live.inbox import INBOX_S_MAX, ON_DEMAND_S_MAX, Inbox
from livebode.sources.live.pauses import Pauses
from livebode.sources.live.position import Position
from livebode.sources.live.reach import TIMEOUT_S, Reach
from livebode.sources.live.sequencer import Sequencer
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.settled import SettledDeliveries
from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch, LiveSpectra
from livebode.sources.live.unconfirmed import CONFIRMED
from livebode.sources.quantities import DeclaredQuantities

TICK_S = 0.1
"""Longest time until a request to end is detected."""
UNDECIDED_S_MAX = 2.0
"""Batches that are in doubt for so long while nothing arrives are acknowledged: the sender may not send more before."""
UNUSABLE_MAX = 16
"""Messages that cannot be used and are retained, so that a person can see what is wrong with them."""
TOGETHER_S = 0.25
"""Longest machine time that is taken from the queue at once: what waits is cheaper together than batch by batch."""


class LiveSource(ABC):
    """A machine that sends its samples in batches, as a source of Blocks.

    A thread receives and reconnects with increasing delay; `blocks` sorts the batches. A source that is not read fast
    enough makes its sender wait; if the sender cannot wait, samples are dropped, which is a gap.

    A sender that stores what it sent receives what it may forget: samples that are recorded. Without a record these are
    the samples before those that `blocks` gave last.

    Use it as a context manager, or call `close`.

    Attributes
    ----------
    has_record
        Whether its reader calls `record` when samples are recorded.
    asks_commit
        Whether the sender sends no more until more of what it sent is recorded.
    backlog_cause
        Why samples wait; its reader reports when it waits for its record.
    retains_unusable
        Whether messages that cannot be used are not reported, but what its reader wants to see.
    """

    format: ClassVar[str]
    reorders: ClassVar[bool] = False
    """Whether batches can arrive in another order than they were sent."""
    waits: ClassVar[bool] = False
    """Whether the sender can wait until the queue has room."""
    on_demand: ClassVar[bool] = False
    """Whether samples can be read faster than they were taken, so that only those that are tracked next are read."""
    queue_s_max: ClassVar[float] = INBOX_S_MAX
    """Longest machine time that waits to be tracked."""
    paced: ClassVar[bool] = True
    """Whether samples arrive when they are taken, so that this computer's clock gives the length of a pause."""

    sender_numbers: ClassVar[bool] = False
    """Whether its Blocks begin with the sender's number of their first sample, and not with 0."""

    def __init__(self, settings: SourceSettings, address: Address) -> None:
        self.settings, self.address = settings, address
        self._quantities = DeclaredQuantities(settings.kinds, settings.units)
        # Also of a source of another package: what is below "livebode" is in its log.
        self._logger = logging.getLogger(f"{__package__}.{type(self).__module__.rpartition('.')[2]}")
        self._events = SourceEvents(log=self._log)
        self._inbox = (
            Inbox(seconds_max=ON_DEMAND_S_MAX, bytes_min=0) if self.on_demand else Inbox(seconds_max=self.queue_s_max)
        )
        self._dropped = Dropped(self._events)
        self._sequencer = Sequencer(
            self._events,
            reorder=settings.reorder_batches if self.reorders else 0,
            rate_hz=settings.rate_hz,
            confirmed=CONFIRMED if self.reorders else 1,
            sender_numbers=self.sender_numbers,
        )
        self._stop = threading.Event()
        self._pauses = Pauses()
        self._thread = threading.Thread(target=self._work, name=f"livebode {address.scheme}", daemon=True)
        self._ready: deque[LiveBlock] = deque()
        self._connected = False
        self._outage = False
        self._failure: BaseException | None = None
        self._refused: SourceError | None = None
        self._trouble: object = Message("nothing was received")
        self._si_channels: tuple[Channel, ...] | None = None  # of the newest batch, if they are in SI units
        self._first: tuple[float, int] | None = None
        self._newest: tuple[float, float | None] | None = None
        self._received = 0
        self._resumed: Position | None = None
        self._settled, self._taken_delivery = SettledDeliveries(), 0
        self.has_record = self.asks_commit = False
        self.backlog_cause = BacklogCause()
        self.senders: set[str] = set()
        """Hosts of those who sent, where any may (UDP)."""
        self.retains_unusable = False
        self.unusable: deque[tuple[float, bytes]] = deque(maxlen=UNUSABLE_MAX)
        """When each of the newest messages that cannot be used came, by `time.monotonic`, and its bytes."""

    @abstractmethod
    def _receive(self) -> bool:
        """Connect and call `_deliver` for each batch, until `_stop` is set (then False) or the sender's end (True).

        Raises
        ------
        OSError
            If there is no connection, or it is lost; `_receive` is called again.
        SourceError
            With the code "refused" if a retry would not help (certificate, password, policy).
        """

    def reach(self) -> Reach:
        """Whether the machine can be reached; at most a connection is opened, and closed again.

        Of a device, which has neither host nor port, this is not known before a run, unless a source overrides it.

        Raises
        ------
        SourceError
            If the settings do not fit this computer.
        """
        host = self.address.host, self.address.port
        if not self.address.host:
            return Reach("not applicable", f"whether {self.address} sends is known when a run begins")
        return Reach.by(lambda: socket.create_connection(host, TIMEOUT_S).close(), self.address)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of the stream, as in its first batch."""
        return self._sequencer.schema.channels

    @property
    def rate_hz(self) -> float:
        assert self._sequencer.schema.rate_hz is not None
        return self._sequencer.schema.rate_hz

    @property
    def spectra(self) -> SpectraLayout | None:
        """Layout of its spectra, if the drive sends spectra; None if it sends samples."""
        return self._sequencer.schema.spectra

    @property
    def trouble(self) -> str:
        """Why no samples came last."""
        return str(self._trouble)

    @property
    def samples(self) -> int | None:
        """None: the end is not known."""
        return None

    @property
    def first_sample(self) -> int | None:
        """The sender's number of the sample at its last start."""
        return self._sequencer.first_sample

    @property
    def health(self) -> Health:
        clock, newest, first = self._sequencer.clock, self._newest, self._first
        measured = None
        if first is not None and newest is not None and newest[0] > first[0]:
            measured = (self._received - first[1]) / (newest[0] - first[0])
        return Health(
            connected=self._connected,
            counts=self._events.counts,
            lost=self._sequencer.lost,
            silent_s=None if newest is None else time.monotonic() - newest[0],
            measured_hz=measured,
            clock_offset_s=None if clock is None else clock.offset_s,
            latency_s=None if newest is None else newest[1],
            waiting_bytes=self._inbox.bytes,
            waiting_s=self.waiting_s,
        )

    @property
    def waiting_s(self) -> float:
        """Machine time that was received and is not tracked yet: the backlog."""
        return self._inbox.seconds

    def resume(self, position: Position) -> None:
        """Continue a record at this position: to be called before `open`.

        Blocks are numbered from there, and the sender's numbers and epoch give exactly what is missing.
        """
        self._resumed = position
        self.record(position.sample)
        self._sequencer.resume(position, paced=self.paced)
        exact = (
            Message("its numbers give what is missing")
            if position.epoch
            else Message("it sends no epoch: if it was restarted during the pause, what is missing is an estimate")
        )
        self._events.report(
            "resumed",
            Message(
                "continues after sample {last_sample} of the sender; {exact}",
                last_sample=position.number - 1,
                exact=exact,
            ),
            sender_sample=position.number,
            epoch=f"{position.epoch:#x}",
        )
        if remark := pause(position.arrived, ClockReading.at(time.monotonic())).remark:
            self._events.report("computer-clock", remark)

    def open(self, late: Callable[[str], None] | None = None) -> Self:
        """Begin to receive, and wait for the first batch.

        If none arrives within `timeout_s`: SourceError. With `late`, it is called once with a message, and the wait
        continues until the machine sends, rejects the connection, or the source is stopped.
        """
        self._log(logging.INFO, f"opening {self.address}")
        self._thread.start()
        until = time.monotonic() + self.settings.timeout_s
        while not self.channels:
            if late is not None and time.monotonic() > until:
                late(
                    Message(
                        "{address}: no samples arrived within {timeout_s:g} s ({why})",
                        address=self.address,
                        timeout_s=self.settings.timeout_s,
                        why=self._trouble,
                    )
                )
                until = inf
            if self._inbox.ended or time.monotonic() > until:
                asked = self._stop.is_set()
                self.close()
                self._raise_failure()
                raise self._refused or self._silence(asked)
            self._take(TICK_S)
        self._check_declared()
        self._log(logging.INFO, f"{len(self.channels)} channels at {self.rate_hz:.9g} Hz")
        return self

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[LiveBlock]:
        """The samples of `channels` as they arrive, from the first received; ends with the sender or with `close`.

        For a drive that sends spectra they are LiveSpectra, with the sums of all its signals.
        There is one stream: samples read by one iteration are not available to another, and the next iteration
        continues with the next sample.

        Raises
        ------
        SourceError
            At once for a missing channel.
        """
        return (block for block in self.stream(channels) if block is not None)

    def stream(self, channels: Sequence[str] | None = None, wait_s: float = TICK_S) -> Iterator[LiveBlock | None]:
        """The same, and None where no samples came for `wait_s`; what came in the meantime is one Block."""
        names = [channel.name for channel in self.channels]
        for name in channels or ():
            if name not in names:
                raise channel_unknown(name, names)
        rows = [names.index(name) for name in (names if channels is None else channels)]
        labels = tuple(self.channels[row] for row in rows)
        if rows == list(range(len(names))):
            return self._stream(wait_s)
        return (None if block is None else _rows(block, rows, labels) for block in self._stream(wait_s))

    def listen(self, listener: Callable[[], None]) -> None:
        """Call `listener`, in place of the one before, when samples came or the source ended; it returns at once."""
        self._inbox.listener = listener

    def expect(self, samples: int) -> None:
        """Call the listener only when so many samples wait, unless they are read on demand."""
        if self.paced and not self.on_demand:
            self._inbox.enough_s = (samples - 0.5) / self.rate_hz

    @property
    def has_more(self) -> bool:
        """Whether samples were received for which the listener is called, and which `stream` has not given."""
        return bool(self._ready) or self._inbox.has_enough

    def record(self, sample: int) -> None:
        """All samples before this one are recorded: their sender may forget them. Any thread may call it."""
        self._settled.record(sample)

    def take_events(self) -> list[Event]:
        """Events since the last call, of the kinds in `livebode.sources.live.KINDS`."""
        return self._events.take()

    def stop(self) -> None:
        """Request the end: `blocks` returns what was received and then ends. May be called from a signal handler."""
        self._stop.set()

    def close(self) -> None:
        """End the source and wait until its connection is closed."""
        self.stop()
        self._inbox.close()
        if self._thread.ident is not None:
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _stream(self, wait_s: float) -> Iterator[LiveBlock | None]:
        while self._ready or not self._inbox.ended:
            if self._ready:
                yield from self._hand_out(self._ready.popleft())
                continue
            if wait_s:
                self._inbox.wait(wait_s)
            if self.paced and not self.on_demand:
                self._take_waiting()
            else:
                self._take(0.0)
            if not self._ready:
                yield None
        doubted = self._sequencer.oldest_doubt  # the end is no reason to settle them
        blocks = self._sequencer.finish()
        self._settle(doubted)
        for block in blocks:
            yield from self._hand_out(block)
        self._raise_failure()

    def _hand_out(self, block: LiveBlock) -> Iterator[LiveBlock]:
        yield block
        if not self.has_record:
            self.record(block.stop)

    def _take(self, timeout_s: float) -> None:
        batch = self._inbox.get(timeout_s)
        if batch is None:
            self._ready += self._sequencer.poll(time.monotonic())
        else:
            self._ready += self._sequencer.push(batch)
            self._taken_delivery = batch.delivery
        self._settle(self._sequencer.oldest_delivery)

    def _take_waiting(self) -> None:
        """Take what waits; what follows each other is one Block."""
        batches = self._inbox.get_waiting(round(TOGETHER_S * self.rate_hz))
        self._ready += self._sequencer.push_together(batches) if batches else self._sequencer.poll(time.monotonic())
        self._taken_delivery = batches[-1].delivery if batches else self._taken_delivery
        self._settle(self._sequencer.oldest_delivery)

    def _settle(self, open_: float) -> None:
        """What was read is settled when the Blocks so far are recorded, except deliveries from `open_` on."""
        if not self._taken_delivery:
            return
        if self._newest is not None and time.monotonic() - self._newest[0] > UNDECIDED_S_MAX:
            open_ = inf
        self._settled.read(int(min(self._taken_delivery, open_ - 1)), self._sequencer.number)

    def _check_declared(self) -> None:
        """SourceError if a kind or a unit is declared for a channel that the stream does not have."""
        names = [channel.name for channel in self.channels]
        for name in self._quantities.names:
            if name not in names:
                self.close()
                raise channel_unknown(name, names)

    def _silence(self, asked: bool) -> SourceError:
        """The error that no samples arrived before the source was stopped or the timeout."""
        when = Message("before the source was stopped")
        if not asked:
            when = Message("within {timeout_s:g} s", timeout_s=self.settings.timeout_s)
        address, cause = str(self.address), self._trouble.code if isinstance(self._trouble, LivebodeError) else ""
        return SourceError(
            "no-samples",
            Message("no samples arrived {when} ({why})", when=when, why=self._trouble),
            Message("compare the sender with [source]")
            if self.unusable
            else Message("check that the machine is on and sends"),
            address=address,
            timeout_s=self.settings.timeout_s,
            cause=cause,
        ).at(address)

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _work(self) -> None:
        try:
            while not self._stop.is_set():
                try:
                    if self._receive():
                        break
                except OSError as error:
                    self._lost_connection(str(error.strerror or error) or type(error).__name__)
                    pause_s = self._pauses.next_s()
                    self._log(logging.DEBUG, f"no connection ({self._trouble}); next attempt in {pause_s:.1f} s")
                    self._stop.wait(pause_s)
        except BaseException as error:  # any error: it must not be lost with the thread
            if isinstance(error, SourceError) and error.code == "source.refused":
                self._refused = error.at(str(self.address))
                self._events.report("refused", Message("{why}; no further attempt is made", why=self._refused))
            else:
                self._failure = error
        finally:
            self._connected = False
            self._dropped.finish()
            self._inbox.close()
            self._log(logging.INFO, "reception ended")

    def _log(self, level: int, message: str) -> None:
        """Log it with the address, which has no user and no password."""
        address = str(self.address)
        self._logger.log(level, "%s", message if address in message else f"{address}: {message}")

    def _established(self) -> None:
        """The connection is established."""
        self._connected, self._outage = True, False
        self._events.report("connected", Message("connected to {address}", address=self.address))

    def _announce(self, channels: tuple[Channel, ...], rate_hz: float) -> None:
        """Set the channels of a record that continues; they are known before new samples arrive."""
        if self._resumed is not None:
            self._sequencer.schema.announce(self._quantities.of(channels), rate_hz)

    def _lost_connection(self, why: str) -> None:
        if not self._outage:
            self._events.report(
                "disconnected",
                Message("{address}: {why}; retrying with increasing delay", address=self.address, why=why),
            )
        self._connected, self._outage, self._trouble = False, True, why

    def _malformed(self, why: object, received: bytes = b"") -> None:
        """What was received cannot be used."""
        if received:
            self.unusable.append((time.monotonic(), received))
        self._trouble = why
        if self.retains_unusable:
            return
        self._events.report("malformed", Message("{address}: {why}", address=self.address, why=why))

    def _deliver(self, batch: AnyBatch, *, waits: bool | None = None) -> None:
        """Add a batch to the queue; `waits`: whether its sender can wait, where it is not the same for all batches."""
        now = time.monotonic()
        self.backlog_cause.take(self.waiting_s, now)
        if batch.channels is not self._si_channels:
            in_si = batch.in_si(self._quantities)
            batch, self._si_channels = in_si, batch.channels if in_si is batch else None
        self._pauses.reset()
        latency = None
        if batch.stamp_s is not None:
            latency = time.time() - (batch.stamp_s + (batch.samples - 1) / batch.rate_hz)
        self._newest = (now, latency)
        self._received += batch.samples
        self._first = self._first or (now, self._received)
        if isnan(batch.arrived_s):
            batch = replace(batch, arrived_s=now)
        if self._inbox.put(batch, self.waits if waits is None else waits):
            self._dropped.finish()
        elif not self._stop.is_set():
            self._dropped.take(batch, self.backlog_cause.advice)


def channel_unknown(name: str, names: list[str]) -> SourceError:
    """The error that the stream has no channel of this name."""
    return SourceError(
        "channel-unknown", f"there is no channel {name!r}", nearest_name(name, names), channel=name, channels=names
    )


def _rows(block: LiveBlock, rows: list[int], channels: tuple[Channel, ...]) -> LiveBlock:
    if isinstance(block, LiveSpectra):
        return block.of_channels(channels)
    return replace(block, data=block.data[rows], channels=channels)
